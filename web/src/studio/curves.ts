// What is read off the curves of a take.
import type { Take } from "./player";

export function valueAt(take: Take, name: string, time: number): number {
  const place = take.shapes.indexOf(name), width = take.shapes.length;
  const at = Math.min(Math.max(time * take.fps, 0), take.frames - 1);
  const here = Math.floor(at), next = Math.min(here + 1, take.frames - 1), share = at - here;
  const [one, two] = [take.weights[here * width + place], take.weights[next * width + place]];
  return one + share * (two - one);
}

const SHUT = 0.5, APART_S = 0.1;
const known = new WeakMap<Take, number[]>();

// When lids are shut the furthest, in s.
export function blinksIn(take: Take): number[] {
  const found = known.get(take);
  if (found) return found;
  const place = take.shapes.indexOf("eyeBlinkLeft"), width = take.shapes.length, times: number[] = [];
  const at = (frame: number) => take.weights[frame * width + place];
  if (place >= 0) {
    for (let frame = 1; frame < take.frames - 1; frame++) {
      const value = at(frame);
      if (value < SHUT || value < at(frame - 1) || value <= at(frame + 1)) continue;
      if (frame / take.fps - (times.at(-1) ?? -1) > APART_S) times.push(frame / take.fps);
    }
  }
  known.set(take, times);
  return times;
}
