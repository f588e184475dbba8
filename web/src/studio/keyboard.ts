// Keys that hold wherever one is, but in fields.
import { looping, now, range } from "./player";
import { zoom } from "./scale";
import { duration, held, hold, name, redo, swap, thePlayer, undo } from "./studio";
import { addBlink, addKey, addSpan, curves } from "./timeline";
import { setSpeed, speed } from "./transport";

// The range begins or ends here.
function bound(side: 0 | 1) {
  const [start, end] = range.value ?? [0, duration.value];
  const next: [number, number] = side ? [Math.min(start, now.value), now.value] : [now.value, Math.max(end, now.value)];
  range.value = next[1] - next[0] > 0.01 ? next : null;
}

const DOES: Record<string, () => void> = {
  Home: () => thePlayer().jump(0),
  End: () => thePlayer().jump(duration.value),
  KeyI: () => bound(0),
  KeyO: () => bound(1),
  KeyL: () => { looping.value = !looping.value; },
  KeyH: () => setSpeed(speed.value === 0.5 ? 1 : 0.5),
  KeyX: () => (held.value ? swap() : hold()),
  KeyC: () => addSpan("lips"),
  KeyB: () => addBlink(),
  KeyK: () => addKey(curves.value[0] ?? "jawOpen"),
};

export function key(event: KeyboardEvent) {
  if (!name.value || event.defaultPrevented) return;
  const { code, target, shiftKey } = event, element = target as Element;
  const field = element.matches?.("input:not([type=range]), textarea, select");
  if ((event.ctrlKey || event.metaKey) && !event.altKey && code === "KeyZ" && !field) {
    event.preventDefault();
    (shiftKey ? redo : undo)();
    return;
  }
  if ((event.ctrlKey || event.metaKey) && code === "KeyY" && !field) {
    event.preventDefault();
    redo();
    return;
  }
  if ((event.ctrlKey || event.metaKey) && code === "KeyS") event.preventDefault(); // it is saved already
  if (event.ctrlKey || event.metaKey || event.altKey || field) return;
  const way = Number(code === "ArrowRight") - Number(code === "ArrowLeft");
  const up = Number(code === "ArrowUp") - Number(code === "ArrowDown");
  const slider = element.matches?.("input[type=range]");
  const button = element.matches?.("button, summary, a") && !element.closest(".lane");
  if (code === "Space" && !button) thePlayer().toggle();
  else if (way && !slider) {
    if (shiftKey) thePlayer().jump(now.value + way);
    else thePlayer().step(way);
  } else if (up && shiftKey) zoom(up > 0 ? 1 / 1.5 : 1.5);
  else if (DOES[code] && !shiftKey) DOES[code]();
  else if (!element.closest?.(".timeline") && thePlayer().camera?.key(code)) { /* the camera went */ }
  else return;
  event.preventDefault();
}
