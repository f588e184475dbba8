// The timeline under the head: sound, words and phones, edits over time, keys of curves.
import { signal, useSignalEffect } from "@preact/signals";
import type { ComponentChildren, JSX } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { clockText } from "../controls.js";
import { blinksIn, valueAt } from "./curves";
import { Drawing } from "./drawing";
import { Icon } from "./icons";
import { now, playing, range } from "./player";
import {
  blinksOf, type Edit, isOpenMark, joined, type Key, keysOf, type Label, type Lane, laneOf, newSpan, type Project,
  REST, rounded, spanOf, split, type Tier, titleOf, withBlinks, withBoundary, withEdit, withKeys, withLabels, withNewEdit,
  withoutEdit, withPlace, withSpan, withText, without,
} from "./project";
import { drag, follow, perSecond, scroll, show, showFirst, timeAt, visible, wide, xOf, zoom } from "./scale";
import { Spectrogram } from "./spectrogram";
import {
  change, draft, duration, held, known, peaks, phones, project, saved, selection, type Selection, showing, shown, styles, take,
  thePlayer, words,
} from "./studio";

const EDGE_PX = 6, NUDGE_S = 0.01, NEW_S = 0.6, NEW_LABEL_S = 0.08, STEP = 0.05;
const WAVE_PX = 52, SPECTRUM_PX = 96, CURVE_PX = 58, TOPS = [0.12, 0.25, 0.5, 1.1]; // of a curve's lane
const BLOCKS_MAX = 500;
const LETTER_PX = 8; // that a letter needs
const OVER_TIME: Lane[] = ["mood", "style", "amplitude", "gaze"];

export const curves = signal<string[]>(["jawOpen"]);
export const spectral = signal(false);

const same = (one: Selection | null, two: Selection) => JSON.stringify(one) === JSON.stringify(two);
const seconds = (time: number) => `${time.toFixed(2)} s`;
const inView = (start: number, end: number) => end >= visible.value[0] && start <= visible.value[1];

export function select(which: Selection | null, time?: number) {
  selection.value = which;
  if (time !== undefined) {
    thePlayer().jump(time);
    follow(time);
  }
}

// Edits of A are looked at, not changed.
const locked = () => showing.value === "A";

// ---- lanes

interface RowProps { title: string; kind?: string; add?: () => void; addLabel?: string; remove?: () => void; children: ComponentChildren; onDblClick?: (time: number) => void; onKeyDown?: (event: KeyboardEvent) => void }

function Row({ title, kind = "", add, addLabel, remove, children, onDblClick, onKeyDown }: RowProps) {
  const lane = useRef<HTMLDivElement>(null);
  const double = (event: MouseEvent) => {
    if (event.target === lane.current || (event.target as Element).tagName === "CANVAS") onDblClick?.(timeAt(event.clientX, lane.current!));
  };
  const press = (event: PointerEvent) => {
    if (event.target !== lane.current && (event.target as Element).tagName !== "CANVAS") return;
    seek(event, lane.current!);
    selection.value = null;
  };
  return (
    <div class={`row ${kind}`}>
      <div class="head">
        <span title={title}>{title}</span>
        {add && <button type="button" class="icon small" aria-label={addLabel} onClick={add} disabled={locked()}><Icon name="plus" /></button>}
        {remove && <button type="button" class="icon small" aria-label={`Hide ${title}`} onClick={remove}><Icon name="cross" /></button>}
      </div>
      <div class="lane" ref={lane} role="group" aria-label={title} onDblClick={double} onPointerDown={press} onKeyDown={onKeyDown}>
        {children}
      </div>
    </div>
  );
}

// The time goes where the pointer is; with shift, what is looped.
function seek(event: PointerEvent, lane: Element) {
  if (event.button !== 0) return;
  const target = event.currentTarget as HTMLElement, first = timeAt(event.clientX, lane);
  target.setPointerCapture(event.pointerId);
  const still = new AbortController();
  const to = (each: PointerEvent) => {
    const time = timeAt(each.clientX, lane);
    if (event.shiftKey) range.value = Math.abs(time - first) < 0.02 ? null : [Math.min(first, time), Math.max(first, time)];
    else thePlayer().jump(time);
  };
  to(event);
  target.addEventListener("pointermove", to, { signal: still.signal });
  for (const over of ["pointerup", "pointercancel"]) target.addEventListener(over, () => still.abort(), { signal: still.signal });
}

interface BlockProps {
  which: Selection; start: number; end: number; text: string; label: string; kind?: string; tab: boolean;
  edges?: (side: 0 | 1) => (time: number) => Project | null;
  move?: (by: number) => Project | null;
}

function Block({ which, start, end, text, label, kind = "", tab, edges, move }: BlockProps) {
  const chosen = same(selection.value, which);
  const press = (event: JSX.TargetedPointerEvent<HTMLButtonElement>) => {
    event.stopPropagation();
    const box = event.currentTarget.getBoundingClientRect(), lane = event.currentTarget.parentElement!;
    const room = Math.min(EDGE_PX, box.width / 3), from = timeAt(event.clientX, lane);
    const side = event.clientX < box.left + room ? 0 : event.clientX > box.right - room ? 1 : null;
    select(which);
    event.currentTarget.focus();
    const does = locked() ? () => null
      : side !== null && edges ? edges(side)
        : (time: number) => move?.(time - from) ?? null;
    drag(event, lane, does, (time) => { if (side === null) thePlayer().jump(time); });
  };
  const left = xOf(start), width = Math.max(2, (end - start) * perSecond());
  return (
    <button
      type="button" class={`block ${kind}`} aria-label={label} aria-pressed={chosen} tabIndex={tab ? 0 : -1}
      style={{ transform: `translateX(${left}px)`, width: `${width}px` }} onPointerDown={press}
      onFocus={() => { if (!chosen) selection.value = which; }}
    >
      {width > LETTER_PX * Math.min(text.length, 3) + 3 && text}
    </button>
  );
}

// Which of a lane's blocks Tab goes to: the chosen one, or the first in view.
function entry(chosen: number, spans: [number, number][]): number {
  if (chosen >= 0) return chosen;
  return spans.findIndex(([start, end]) => inView(start, end));
}

// Once it is drawn, the keyboard goes to what was chosen.
export function focusChosen() {
  requestAnimationFrame(() => {
    document.querySelector<HTMLElement>(".timeline .lane [aria-pressed=true]")?.focus({ preventScroll: false });
  });
}

// ---- words and phones

const SHUT = new Set(["P", "B", "M"]), TEETH = new Set(["F", "V"]);
const VOWELS = new Set(["AA", "AE", "AH", "AO", "AW", "AY", "EH", "ER", "EY", "IH", "IY", "OW", "OY", "UH", "UW"]);

export function kindOf(phone: string): string {
  const bare = phone.replace(/\d$/, "");
  if (SHUT.has(bare)) return "shut";
  if (TEETH.has(bare)) return "teeth";
  if (VOWELS.has(bare)) return "vowel";
  return bare === REST ? "rest" : "consonant";
}

export function relabel(tier: Tier, labels: Label[], index: number) {
  if (!saved.value || locked()) return;
  change(withLabels(saved.value, tier, labels));
  selection.value = labels[index] ? { kind: tier, index } : null;
  focusChosen();
}

export const labelsOf = (tier: Tier) => (tier === "phones" ? phones : words).value;

// As they are saved, whatever is dragged.
const kept = (tier: Tier) => saved.value?.[tier] ?? take.value?.[tier] ?? [];

export const doTo = {
  split: (tier: Tier, index: number) => relabel(tier, split(labelsOf(tier), index, now.value), index),
  join: (tier: Tier, index: number) => relabel(tier, joined(labelsOf(tier), index, tier), index),
  // What is no phone is a rest.
  remove: (tier: Tier, index: number) => relabel(tier, without(labelsOf(tier), index), index),
  insert: (tier: Tier, time: number) => {
    const labels = labelsOf(tier), index = labels.findIndex(([, end]) => end > time), place = index < 0 ? labels.length : index;
    const end = Math.min(time + NEW_LABEL_S, labels[place]?.[0] ?? duration.value);
    if (end - time < NUDGE_S) return;
    const made: Label = [rounded(time), rounded(end), tier === "phones" ? "AH" : "…"];
    relabel(tier, [...labels.slice(0, place), made, ...labels.slice(place)], place);
  },
  text: (tier: Tier, index: number, text: string) => relabel(tier, withText(labelsOf(tier), index, text), index),
  bound: (tier: Tier, index: number, side: 0 | 1, time: number) =>
    relabel(tier, withBoundary(labelsOf(tier), index, side, time), index),
};

// More than can be told apart: colours alone; they are blocks once one comes nearer.
function Strip({ labels, tier }: { labels: Label[]; tier: Tier }) {
  return (
    <Drawing height={24} label={`${labels.length} ${tier}; zoom in to change them`} draw={(pen, _, height, ink) => {
      labels.forEach(([start, end, text]) => {
        pen.fillStyle = ink(tier === "phones" ? kindOf(text) : "line");
        pen.fillRect(xOf(start), 2, Math.max(1, (end - start) * perSecond() - 0.5), height - 4);
      });
    }} />
  );
}

function Labels({ tier }: { tier: Tier }) {
  const labels = labelsOf(tier), title = tier === "phones" ? "Phones" : "Words";
  const chosen = selection.value?.kind === tier ? selection.value.index : -1;
  const first = entry(chosen, labels.map(([start, end]) => [start, end]));
  const seen = labels.filter(([start, end]) => inView(start, end)), crowded = seen.length > BLOCKS_MAX;
  const key = (event: KeyboardEvent) => {
    const { code, shiftKey } = event;
    if (chosen < 0 || event.ctrlKey || event.metaKey || event.altKey) return;
    const [start, end] = labels[chosen] ?? [0, 0];
    const to = chosen + Number(code === "ArrowDown") - Number(code === "ArrowUp");
    const nudge = Number(code === "Period") - Number(code === "Comma");
    if (!shiftKey && labels[to] && to !== chosen) {
      select({ kind: tier, index: to }, (labels[to][0] + labels[to][1]) / 2);
      focusChosen();
    } else if (nudge) doTo.bound(tier, chosen, shiftKey ? 0 : 1, (shiftKey ? start : end) + nudge * NUDGE_S);
    else if (code === "KeyS") doTo.split(tier, chosen);
    else if (code === "KeyJ") doTo.join(tier, chosen);
    else if (code === "Delete" || code === "Backspace") doTo.remove(tier, chosen);
    else if (code === "Enter") document.getElementById("field")?.focus();
    else return;
    event.preventDefault();
    event.stopPropagation();
  };
  return (
    <Row title={title} kind={tier} onKeyDown={key} onDblClick={(time) => doTo.insert(tier, time)}>
      {!labels.length && <span class="none">{tier === "words" ? "With the text of what is said, its words stand here" : ""}</span>}
      {crowded ? <Strip labels={seen} tier={tier} /> : labels.map(([start, end, text], index) => inView(start, end) && (
        <Block
          key={index} which={{ kind: tier, index }} start={start} end={end} text={text === REST ? "" : text} tab={index === first}
          kind={tier === "phones" ? kindOf(text) : "word"} label={`${text === REST ? "rest" : text}, ${start.toFixed(2)} to ${seconds(end)}`}
          edges={(side) => (time) => saved.value && withLabels(saved.value, tier, withBoundary(kept(tier), index, side, time))}
          move={(by) => saved.value && withLabels(saved.value, tier, withPlace(kept(tier), index, by))}
        />
      ))}
    </Row>
  );
}

// ---- spans

export const TITLES: Record<Lane, string> = { lips: "Lips", mood: "Mood", style: "Style", amplitude: "Amplitude", gaze: "Gaze" };
const usual = () => ({
  mood: known.value?.moods.find((each) => each !== "neutral") ?? "happy",
  style: styles.value.find((each) => each !== "plain") ?? "plain",
});

export function addSpan(kind: Lane | "open", time = now.value) {
  const here = saved.value;
  if (!here || locked()) return;
  const short = kind === "lips" || kind === "open" ? NEW_S / 3 : NEW_S;
  const [start, end] = range.value ?? [time, time + short];
  const last = Math.min(end, duration.value), begin = Math.max(0, Math.min(start, last - 0.05));
  change(withNewEdit(here, newSpan(kind, begin, last, usual())));
  selection.value = { kind: "edit", index: here.edits.length };
  focusChosen();
}

export function reEdit(index: number, edit: Edit | null) {
  if (!saved.value || locked()) return;
  change(edit ? withEdit(saved.value, index, edit) : withoutEdit(saved.value, index));
  if (!edit) selection.value = null;
}

function Spans({ lane }: { lane: Lane }) {
  const edits = project.value?.edits ?? [];
  const whole = duration.value;
  const mine = edits.map((edit, index) => ({ edit, index })).filter(({ edit }) => laneOf(edit) === lane);
  const chosen = selection.value?.kind === "edit" ? mine.findIndex(({ index }) => same(selection.value, { kind: "edit", index })) : -1;
  const tab = entry(chosen, mine.map(({ edit }) => spanOf(edit, whole)));
  const key = (event: KeyboardEvent) => {
    const { code, shiftKey } = event;
    if (chosen < 0 || event.ctrlKey || event.metaKey || event.altKey) return;
    const { edit, index } = mine[chosen], [start, end] = spanOf(edit, whole);
    const other = mine[chosen + Number(code === "ArrowDown") - Number(code === "ArrowUp")];
    const nudge = (Number(code === "Period") - Number(code === "Comma")) * NUDGE_S;
    if (!shiftKey && other && other !== mine[chosen]) {
      select({ kind: "edit", index: other.index }, spanOf(other.edit, whole)[0]);
      focusChosen();
    } else if (nudge) reEdit(index, withSpan(edit, start + (shiftKey ? nudge : 0), end + (shiftKey ? 0 : nudge)));
    else if (code === "Delete" || code === "Backspace") reEdit(index, null);
    else if (code === "Enter") document.getElementById("field")?.focus();
    else return;
    event.preventDefault();
    event.stopPropagation();
  };
  const moved = (index: number, to: (start: number, end: number) => [number, number]): Project | null => {
    const here = saved.value, edit = here?.edits[index];
    if (!here || !edit) return null;
    const [start, end] = to(...spanOf(edit, whole));
    return end - start < 0.02 ? null : withEdit(here, index, withSpan(edit, start, Math.min(end, whole)));
  };
  const contacts = lane === "lips" ? shown.value?.contacts ?? [] : [];
  return (
    <Row title={TITLES[lane]} kind="spans" add={() => addSpan(lane)} onDblClick={(time) => addSpan(lane, time)} onKeyDown={key}
      addLabel={lane === "lips" ? "Lips shut here" : `${TITLES[lane]} from here`}>
      {contacts.map(([start, end], index) => inView(start, end) && (
        <i key={`c${index}`} class="contact" style={{ transform: `translateX(${xOf(start)}px)`, width: `${Math.max(2, (end - start) * perSecond())}px` }} />
      ))}
      {mine.map(({ edit, index }, place) => {
        const [start, end] = spanOf(edit, whole);
        return inView(start, end) && (
          <Block
            key={index} which={{ kind: "edit", index }} start={start} end={end} text={titleOf(edit)} tab={place === tab}
            kind={`edit ${lane} ${isOpenMark(edit) ? "open" : ""}`} label={`${TITLES[lane]} ${titleOf(edit)}, ${start.toFixed(2)} to ${seconds(end)}`}
            edges={(side) => (time) => moved(index, (from, to) => (side ? [from, time] : [time, to]))}
            move={(by) => moved(index, (from, to) => [Math.max(0, from + by), Math.max(0, from + by) + to - from])}
          />
        );
      })}
    </Row>
  );
}

// ---- blinks

const NEAR_S = 0.15; // as the edit list has it

export function setBlinks(make: (add: number[], remove: number[] | "all") => [number[], number[] | "all"]) {
  const here = saved.value;
  if (!here || locked()) return;
  const { add, remove } = blinksOf(here, duration.value);
  const [added, removed] = make(add, remove);
  change(withBlinks(here, { add: added, remove: removed }));
}

export function addBlink(time = now.value) {
  setBlinks((add, remove) => [[...add, time], remove]);
  selection.value = { kind: "blink", time: Math.round(time * 1000) / 1000, made: true };
  focusChosen();
}

export function removeBlink(time: number, made: boolean) {
  selection.value = null;
  if (made) setBlinks((add, remove) => [add.filter((each) => Math.abs(each - time) > 0.001), remove]);
  else setBlinks((add, remove) => [add, remove === "all" ? remove : [...remove, time]]);
}

function Marks() {
  const here = project.value, on = shown.value;
  if (!here || !on) return null;
  const { add } = blinksOf(here, duration.value);
  const marks = [
    ...blinksIn(on).filter((time) => !add.some((each) => Math.abs(each - time) < NEAR_S)).map((time) => ({ time, made: false })),
    ...add.map((time) => ({ time, made: true })),
  ].sort((one, two) => one.time - two.time);
  const which = (mark: { time: number; made: boolean }): Selection => ({ kind: "blink", ...mark });
  const chosen = marks.findIndex((mark) => same(selection.value, which(mark)));
  const tab = entry(chosen, marks.map(({ time }) => [time, time]));
  const moved = (from: number, to: number) => withBlinks(saved.value!, {
    ...blinksOf(saved.value!, duration.value),
    add: add.map((each) => (each === from ? to : each)),
  });
  const key = (event: KeyboardEvent) => {
    const { code } = event;
    if (chosen < 0 || event.ctrlKey || event.metaKey || event.altKey) return;
    const { time, made } = marks[chosen];
    const other = marks[chosen + Number(code === "ArrowDown") - Number(code === "ArrowUp")];
    const nudge = (Number(code === "Period") - Number(code === "Comma")) * NUDGE_S;
    if (other && other !== marks[chosen]) { select(which(other), other.time); focusChosen(); }
    else if (nudge && made) {
      change(moved(time, time + nudge));
      selection.value = { kind: "blink", time: Math.round((time + nudge) * 1000) / 1000, made };
      focusChosen();
    } else if (code === "Delete" || code === "Backspace") removeBlink(time, made);
    else return;
    event.preventDefault();
    event.stopPropagation();
  };
  return (
    <Row title="Blinks" kind="marks" add={() => addBlink()} addLabel="A blink here" onDblClick={addBlink} onKeyDown={key}>
      {marks.map((mark, place) => inView(mark.time, mark.time) && (
        <button
          key={`${mark.made}${place}`} type="button" class={`mark ${mark.made ? "made" : ""}`} tabIndex={place === tab ? 0 : -1}
          aria-label={`Blink at ${seconds(mark.time)}${mark.made ? ", yours" : ""}`} aria-pressed={place === chosen}
          style={{ transform: `translateX(${xOf(mark.time)}px)` }} onFocus={() => { if (place !== chosen) selection.value = which(mark); }}
          onPointerDown={(event) => {
            event.stopPropagation();
            select(which(mark), mark.time);
            event.currentTarget.focus();
            if (mark.made && !locked()) drag(event, event.currentTarget.parentElement!, (time) => moved(mark.time, time));
          }}
        />
      ))}
    </Row>
  );
}

// ---- curves

export function addKey(curve: string, time = now.value, value?: number) {
  const here = saved.value, on = take.value;
  if (!here || !on || locked()) return;
  const keys = keysOf(here, curve, duration.value).filter(([each]) => Math.abs(each - time) > 0.005);
  const all = [...keys, [time, value ?? valueAt(on, curve, time)] as Key].sort(([one], [two]) => one - two);
  change(withKeys(here, curve, all, duration.value));
  selection.value = { kind: "key", curve, index: all.findIndex(([each]) => each === time) };
  focusChosen();
}

export function setKey(curve: string, index: number, key: Key | null) {
  const here = saved.value;
  if (!here || locked()) return;
  const keys = keysOf(here, curve, duration.value);
  const all = key ? keys.map((each, place) => (place === index ? key : each)) : without(keys, index);
  change(withKeys(here, curve, all, duration.value));
  if (!key) selection.value = null;
  else focusChosen();
}

// The lane is as high as the curve is, in a few steps.
function topOf(curve: string, keys: Key[]): number {
  const on = take.value, place = on?.shapes.indexOf(curve) ?? -1;
  let most = Math.max(0, ...keys.map(([, value]) => value));
  if (on && place >= 0) for (let at = place; at < on.weights.length; at += on.shapes.length) most = Math.max(most, on.weights[at]);
  return TOPS.find((each) => each > 1.1 * most) ?? TOPS.at(-1)!;
}

function Curve({ curve }: { curve: string }) {
  const here = project.value;
  const keys = here ? keysOf(here, curve, duration.value) : [];
  const chosen = selection.value?.kind === "key" && selection.value.curve === curve ? selection.value.index : -1;
  const tab = entry(chosen, keys.map(([time]) => [time, time]));
  const top = topOf(curve, keys);
  const y = (value: number) => CURVE_PX - 4 - (value / top) * (CURVE_PX - 8);
  const between = (index: number, time: number) =>
    Math.min(Math.max(time, (keys[index - 1]?.[0] ?? -0.01) + 0.01), (keys[index + 1]?.[0] ?? duration.value + 0.01) - 0.01);
  const key = (event: KeyboardEvent) => {
    const { code } = event;
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    if (chosen < 0) return;
    const [time, value] = keys[chosen] ?? [0, 0];
    const to = chosen + Number(code === "ArrowDown") - Number(code === "ArrowUp");
    const nudge = (Number(code === "Period") - Number(code === "Comma")) * NUDGE_S;
    const up = (Number(code === "PageUp") - Number(code === "PageDown")) * STEP;
    if (keys[to] && to !== chosen) { select({ kind: "key", curve, index: to }, keys[to][0]); focusChosen(); }
    else if (nudge || up) setKey(curve, chosen, [between(chosen, time + nudge), value + up]);
    else if (code === "Delete" || code === "Backspace") setKey(curve, chosen, null);
    else if (code === "Enter") document.getElementById("field")?.focus();
    else return;
    event.preventDefault();
    event.stopPropagation();
  };
  return (
    <Row title={curve} kind="curve" add={() => addKey(curve)} addLabel={`A key of ${curve} here`} onKeyDown={key}
      remove={() => { curves.value = curves.value.filter((each) => each !== curve); }} onDblClick={(time) => addKey(curve, time)}>
      <Drawing height={CURVE_PX} label={`${curve} over time`} draw={(pen, width, height, ink) => {
        const line = (on: typeof take.value, colour: string) => {
          const place = on ? on.shapes.indexOf(curve) : -1;
          if (!on || place < 0) return;
          const [from, to] = visible.value, last = Math.min(on.frames - 1, Math.ceil(to * on.fps));
          const step = Math.max(1, Math.floor((to - from) * on.fps / (2 * width)));
          pen.beginPath();
          for (let frame = Math.max(0, Math.floor(from * on.fps)); frame <= last; frame += step) {
            pen.lineTo(xOf(frame / on.fps), y(on.weights[frame * on.shapes.length + place]));
          }
          pen.strokeStyle = colour;
          pen.stroke();
        };
        pen.fillStyle = ink("dim");
        pen.font = "10px system-ui, sans-serif";
        pen.fillText(String(Math.min(top, 1)), 3, 12);
        pen.strokeStyle = ink("line");
        pen.lineWidth = 1;
        for (const value of [0, 1]) { pen.beginPath(); pen.moveTo(0, y(value)); pen.lineTo(width, y(value)); pen.stroke(); }
        pen.lineWidth = 1.5;
        if (held.value) line(showing.value === "A" ? take.value : held.value.take, ink("dim"));
        line(shown.value, ink("accent"));
        void height;
      }} />
      {keys.map(([time, value], index) => inView(time, time) && (
        <button
          key={index} type="button" class="key" tabIndex={index === tab ? 0 : -1} aria-pressed={index === chosen}
          aria-label={`Key of ${curve}: ${value.toFixed(2)} at ${seconds(time)}`}
          style={{ transform: `translate(${xOf(time)}px, ${y(Math.min(value, top))}px)` }}
          onFocus={() => { if (index !== chosen) selection.value = { kind: "key", curve, index }; }}
          onPointerDown={(event) => {
            event.stopPropagation();
            select({ kind: "key", curve, index }, time);
            event.currentTarget.focus();
            const lane = event.currentTarget.parentElement!, { top: above } = lane.getBoundingClientRect();
            if (!locked()) drag(event, lane, (to, { clientY }) => {
              const height = Math.min(Math.max((CURVE_PX - 4 - (clientY - above)) / (CURVE_PX - 8) * top, 0), 1);
              const moved = keysOf(saved.value!, curve, duration.value)
                .map((each, place): Key => (place === index ? [between(index, to), height] : each));
              return withKeys(saved.value!, curve, moved, duration.value);
            });
          }}
        />
      ))}
    </Row>
  );
}

// ---- the sound and the time

const STEPS_S = [0.01, 0.02, 0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 30, 60, 300];
const TICK_PX = 70;

function Ruler() {
  return (
    <Row title="" kind="ruler">
      <Drawing height={22} label="Time" draw={(pen, width, height, ink) => {
        const [from, to] = visible.value;
        const step = STEPS_S.find((each) => each * perSecond() > TICK_PX) ?? 600;
        pen.font = "11px system-ui, sans-serif";
        pen.fillStyle = ink("dim");
        pen.strokeStyle = ink("line");
        if (range.value) {
          const [start, end] = range.value;
          pen.globalAlpha = 0.35;
          pen.fillStyle = ink("accent");
          pen.fillRect(xOf(start), 0, (end - start) * perSecond(), height);
          pen.globalAlpha = 1;
          pen.fillStyle = ink("ink");
        }
        for (let at = Math.ceil(from / step - 1e-6); at * step <= to; at++) {
          const time = at * step, place = xOf(time);
          pen.beginPath(); pen.moveTo(place, height - 6); pen.lineTo(place, height); pen.stroke();
          pen.fillText(step < 0.1 ? time.toFixed(2) : clockText(time + 1e-6).replace(step >= 1 ? /\.\d$/ : /$^/, ""), Math.min(place + 3, width - 30), height - 8);
        }
      }} />
    </Row>
  );
}

function Wave() {
  return (
    <Row title="Sound" kind={spectral.value ? "wave tall" : "wave"}>
      {spectral.value && <Spectrogram height={SPECTRUM_PX} />}
      <Drawing height={spectral.value ? SPECTRUM_PX : WAVE_PX} label="Waveform" draw={(pen, width, height, ink) => {
        const found = peaks.value;
        const middle = height / 2;
        if (range.value) {
          pen.globalAlpha = 0.14;
          pen.fillStyle = ink("accent");
          pen.fillRect(xOf(range.value[0]), 0, (range.value[1] - range.value[0]) * perSecond(), height);
          pen.globalAlpha = 1;
        }
        pen.fillStyle = ink(spectral.value ? "line" : "dim");
        if (!found) return;
        const { min, max, per_second: rate } = found, [from] = visible.value, each = rate / perSecond();
        for (let place = 0; place < width; place++) {
          const first = Math.floor(from * rate + place * each), last = Math.max(first + 1, Math.floor(from * rate + (place + 1) * each));
          let low = 0, high = 0;
          for (let at = first; at < last; at++) {
            low = Math.min(low, min[at] ?? 0);
            high = Math.max(high, max[at] ?? 0);
          }
          pen.fillRect(place, middle - high * (middle - 2) - 0.5, 1, (high - low) * (middle - 2) + 1);
        }
      }} />
    </Row>
  );
}

function Playhead() {
  const line = useRef<HTMLDivElement>(null);
  useSignalEffect(() => {
    const at = xOf(now.value);
    if (line.current) {
      line.current.style.transform = `translateX(${at}px)`;
      line.current.hidden = at < -1 || at > wide.value + 1;
    }
  });
  useSignalEffect(() => { if (playing.value) follow(now.value); });
  return <div class="playhead" ref={line} />;
}

// What of the whole is in view; it is dragged, and scrolled by arrows.
function Overview() {
  const [from, to] = visible.value, whole = duration.value || 1;
  if (to - from > whole - 0.01) return null;
  const press = (event: JSX.TargetedPointerEvent<HTMLDivElement>) => {
    const { currentTarget: room } = event, { left, width } = room.getBoundingClientRect(), start = event.clientX, [first] = visible.value;
    const inside = start >= left + (first / whole) * width && start <= left + (visible.value[1] / whole) * width;
    const base = inside ? first : ((start - left) / width) * whole - (to - from) / 2;
    show(base, base + to - from);
    room.setPointerCapture(event.pointerId);
    const still = new AbortController();
    room.addEventListener("pointermove", (each) => {
      const at = base + ((each.clientX - start) / width) * whole;
      show(at, at + to - from);
    }, { signal: still.signal });
    room.addEventListener("pointerup", () => still.abort(), { signal: still.signal });
  };
  const key = (event: KeyboardEvent) => {
    const way = Number(event.code === "ArrowRight") - Number(event.code === "ArrowLeft");
    if (!way) return;
    scroll(way * (to - from) / 4);
    event.preventDefault();
    event.stopPropagation();
  };
  return (
    <div class="overview" role="scrollbar" aria-controls="lanes" aria-orientation="horizontal" aria-label="What of the take is in view" tabIndex={0}
      aria-valuemin={0} aria-valuemax={100} aria-valuenow={Math.round(100 * from / Math.max(whole - (to - from), 0.01))} onPointerDown={press} onKeyDown={key}>
      <i style={{ left: `${100 * from / whole}%`, width: `${100 * (to - from) / whole}%` }} />
    </div>
  );
}

// Between the head and the timeline: which of them has how much room.
function Divider() {
  const height = () => document.querySelector(".timeline")!.getBoundingClientRect().height;
  const set = (pixels: number) => document.documentElement.style.setProperty("--timeline", `${Math.max(120, pixels)}px`);
  const press = (event: JSX.TargetedPointerEvent<HTMLDivElement>) => {
    const { currentTarget: line, clientY } = event, first = height(), still = new AbortController();
    line.setPointerCapture(event.pointerId);
    line.addEventListener("pointermove", (each) => set(first + clientY - each.clientY), { signal: still.signal });
    line.addEventListener("pointerup", () => still.abort(), { signal: still.signal });
  };
  const key = (event: KeyboardEvent) => {
    const way = Number(event.code === "ArrowUp") - Number(event.code === "ArrowDown");
    if (!way || event.shiftKey) return;
    set(height() + 24 * way);
    event.preventDefault();
    event.stopPropagation();
  };
  return <div class="divider" role="separator" tabIndex={0} aria-orientation="horizontal" aria-label="Height of the timeline" aria-valuenow={50} onPointerDown={press} onKeyDown={key} />;
}

export function Timeline() {
  const lanes = useRef<HTMLDivElement>(null), { value: whole } = duration;
  useEffect(() => {
    const room = lanes.current!;
    const measure = () => { wide.value = Math.max(50, room.querySelector(".lane")!.clientWidth); };
    const watch = new ResizeObserver(measure);
    watch.observe(room);
    const wheel = (event: WheelEvent) => {
      const along = Math.abs(event.deltaX) > Math.abs(event.deltaY) ? event.deltaX : event.shiftKey ? event.deltaY : 0;
      if (event.ctrlKey) zoom(Math.exp(event.deltaY / 300), timeAt(event.clientX, room.querySelector(".lane")!));
      else if (along) scroll(along / perSecond());
      else return;
      event.preventDefault();
    };
    room.addEventListener("wheel", wheel, { passive: false });
    return () => { watch.disconnect(); room.removeEventListener("wheel", wheel); };
  }, []);
  useEffect(showFirst, [whole]);
  const edits = project.value?.edits ?? [];
  const keyed = edits.filter((edit) => laneOf(edit) === "curve").map((edit) => String(edit.curve));
  const names = [...new Set([...curves.value, ...keyed])];
  const rest = (take.value?.shapes ?? []).filter((each) => !names.includes(each));
  return (
    <section class={`timeline ${draft.value ? "dragging" : ""}`} aria-label="Timeline">
      <Divider />
      <div class="lanes" id="lanes" ref={lanes}>
        <Ruler />
        <Wave />
        <Labels tier="words" />
        <Labels tier="phones" />
        <Spans lane="lips" />
        {OVER_TIME.filter((lane) => edits.some((edit) => laneOf(edit) === lane)).map((lane) => <Spans key={lane} lane={lane} />)}
        <Marks />
        {names.map((curve) => <Curve key={curve} curve={curve} />)}
        <div class="over"><Playhead /></div>
      </div>
      <div class="more wide-only">
        <span class="dim">Over time:</span>
        {OVER_TIME.map((lane) => <button key={lane} type="button" disabled={locked()} onClick={() => addSpan(lane)}><Icon name="plus" /> {TITLES[lane]}</button>)}
        <select aria-label="Show a curve" value="" onChange={({ currentTarget }) => { curves.value = [...curves.value, currentTarget.value]; currentTarget.value = ""; }}>
          <option value="">+ Curve…</option>
          {rest.map((each) => <option key={each}>{each}</option>)}
        </select>
      </div>
      <Overview />
    </section>
  );
}
