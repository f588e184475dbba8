// Where a time lies on the timeline, what is drawn there, and what a pointer does to it.
import { signal } from "@preact/signals";
import { now, playing } from "./player";
import type { Project } from "./project";
import { change, draft, duration } from "./studio";

const LEAST_S = 0.15; // of the timeline in view
const READ_S_PX = 1 / 60; // so that words are no narrower than they are long
const AHEAD = 0.08; // of it that is left in view before a playing time

export const visible = signal<[number, number]>([0, 1]);
export const wide = signal(800); // px

export const perSecond = () => wide.value / (visible.value[1] - visible.value[0]);
export const xOf = (time: number) => (time - visible.value[0]) * perSecond();

export function show(start: number, end: number) {
  const whole = Math.max(duration.value, LEAST_S);
  const length = Math.min(Math.max(end - start, LEAST_S), whole);
  const first = Math.min(Math.max(start, 0), whole - length);
  visible.value = [first, first + length];
}

export const showAll = () => show(0, duration.value);

// As much of a take as can be read: all of a line, the first words on a phone.
export const showFirst = () => show(0, Math.min(duration.value, wide.value * READ_S_PX));

export function zoom(factor: number, around = now.value) {
  const [start, end] = visible.value;
  const middle = Math.min(Math.max(around, start), end);
  show(middle - (middle - start) * factor, middle + (end - middle) * factor);
}

export function scroll(seconds: number) {
  const [start, end] = visible.value;
  show(start + seconds, end + seconds);
}

// So that a time is seen; while it plays, a page at a time.
export function follow(time: number) {
  const [start, end] = visible.value, length = end - start;
  if (end >= duration.value && time > start) return;
  if (playing.value && time > end - AHEAD * length) show(time - AHEAD * length, time + (1 - AHEAD) * length);
  else if (time < start || time > end) show(time - length / 2, time + length / 2);
}

export function timeAt(clientX: number, lane: Element): number {
  const { left } = lane.getBoundingClientRect();
  return Math.min(Math.max(visible.value[0] + (clientX - left) / perSecond(), 0), duration.value);
}

const STILL_PX = 3;

// Follow a pointer until it is let go: what it makes of the project is shown, and taken at the end.
// Escape gives it up. A press that does not move is a click.
export function drag(
  event: PointerEvent, lane: Element,
  move: (time: number, event: PointerEvent) => Project | null,
  click?: (time: number) => void,
) {
  if (event.button !== 0) return;
  const target = event.currentTarget as HTMLElement, from = [event.clientX, event.clientY];
  let moved = false;
  target.setPointerCapture(event.pointerId);
  const still = new AbortController(), listen = { signal: still.signal };
  target.addEventListener("pointermove", (each) => {
    moved ||= Math.hypot(each.clientX - from[0], each.clientY - from[1]) > STILL_PX;
    if (moved) draft.value = move(timeAt(each.clientX, lane), each) ?? draft.value;
  }, listen);
  const end = (taken: boolean) => {
    still.abort();
    if (!taken) draft.value = null;
    else if (moved && draft.value) change(draft.value);
    else if (!moved) click?.(timeAt(from[0], lane));
  };
  target.addEventListener("pointerup", () => end(true), listen);
  target.addEventListener("pointercancel", () => end(false), listen);
  addEventListener("keydown", ({ code }) => { if (code === "Escape") end(false); }, listen);
}
