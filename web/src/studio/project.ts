// A project as its file has it, and what a person does to it. Nothing here changes what it is
// given: each step gives a new project, which is what undoing rests on.

export type Label = [start: number, end: number, text: string];
export type Moment = number | string; // seconds, "end" or "end-0.5"
export type Edit = { edit: string; from?: Moment; to?: Moment } & Record<string, unknown>;
export type Tier = "phones" | "words";

export interface Project {
  elocute_project: number;
  sound: string;
  character: string | null;
  text: string | null;
  language: string | null;
  phones: Label[] | null;
  words: Label[] | null;
  edits: Edit[];
  settings: Record<string, unknown>;
  options: Record<string, unknown>;
  [more: string]: unknown;
}

// What a file may leave out.
export const EMPTY = {
  character: null, text: null, language: null, phones: null, words: null, edits: [], settings: {}, options: {}, locks: {},
};

export const REST = "SIL";
const LEAST_S = 0.01; // of a phone or a word
const TOUCHING_S = 0.002;

// Times in files are read by people.
export const rounded = (seconds: number) => Math.round(seconds * 1000) / 1000;
const clamp = (value: number, low: number, high: number) => Math.min(Math.max(value, low), high);

// ---- phones and words

// Move the start or the end of a label; a neighbour that touches it goes along.
export function withBoundary(labels: Label[], index: number, side: 0 | 1, time: number): Label[] {
  const moved = labels.map((label) => [...label] as Label);
  const own = moved[index], other = moved[side ? index + 1 : index - 1];
  if (!own) return labels;
  const touches = other && Math.abs(other[1 - side] as number - own[side]) < TOUCHING_S;
  const outer = other && (touches ? (other[side] as number) - (side ? LEAST_S : -LEAST_S) : other[1 - side] as number);
  const low = side ? own[0] + LEAST_S : outer ?? 0;
  const high = side ? outer ?? Infinity : own[1] - LEAST_S;
  const at = rounded(clamp(time, low, Math.max(low, high)));
  own[side] = at;
  if (touches) other[side ? 0 : 1] = at;
  return moved;
}

// Move a whole label; neighbours that touch it follow, and give way.
export function withPlace(labels: Label[], index: number, by: number): Label[] {
  const sides: (0 | 1)[] = by > 0 ? [1, 0] : [0, 1];
  return sides.reduce((moved, side) => withBoundary(moved, index, side, labels[index][side] + by), labels);
}

export function withText(labels: Label[], index: number, text: string): Label[] {
  return labels.map((label, place) => (place === index ? [label[0], label[1], text] : label));
}

// Two of one, at a time within it or in its middle.
export function split(labels: Label[], index: number, time: number): Label[] {
  const [start, end, text] = labels[index];
  if (end - start < 2 * LEAST_S) return labels;
  const inside = time > start + LEAST_S && time < end - LEAST_S;
  const at = rounded(inside ? time : (start + end) / 2);
  return [...labels.slice(0, index), [start, at, text], [at, end, text], ...labels.slice(index + 1)];
}

// One of a label and the next; words keep both texts.
export function joined(labels: Label[], index: number, tier: Tier): Label[] {
  const [one, two] = labels.slice(index, index + 2);
  if (!two) return labels;
  const text = tier === "words" && one[2] !== two[2] ? `${one[2]} ${two[2]}` : one[2];
  return [...labels.slice(0, index), [one[0], two[1], text], ...labels.slice(index + 2)];
}

export function without<T>(list: T[], index: number): T[] {
  return list.filter((_, place) => place !== index);
}

export function withLabels(project: Project, tier: Tier, labels: Label[]): Project {
  return { ...project, [tier]: labels };
}

// ---- edits

export function withEdit(project: Project, index: number, edit: Edit): Project {
  return { ...project, edits: project.edits.map((each, place) => (place === index ? edit : each)) };
}

export function withNewEdit(project: Project, edit: Edit): Project {
  return { ...project, edits: [...project.edits, edit] };
}

export function withoutEdit(project: Project, index: number): Project {
  return { ...project, edits: without(project.edits, index) };
}

export function withSetting(project: Project, name: string, value: unknown): Project {
  const settings = { ...project.settings, [name]: value };
  if (value === undefined) delete settings[name];
  return { ...project, settings };
}

export function secondsOf(moment: Moment | undefined, duration: number, absent: number): number {
  if (moment === undefined) return absent;
  if (typeof moment === "number") return moment;
  return duration - Number(/-\s*([\d.]+)/.exec(moment)?.[1] ?? 0);
}

export function spanOf(edit: Edit, duration: number): [number, number] {
  return [secondsOf(edit.from, duration, 0), secondsOf(edit.to, duration, duration)];
}

export function withSpan(edit: Edit, start: number, end: number): Edit {
  return { ...edit, from: rounded(Math.max(0, start)), to: rounded(end) };
}

// ---- the lanes of an edit list

export const LANES = ["lips", "mood", "style", "amplitude", "gaze"] as const;
export type Lane = (typeof LANES)[number];
const OPEN_WEIGHT = 0.25;

// Lips that are held open: the jaw, against whatever seals them.
export function isOpenMark(edit: Edit): boolean {
  const keys = edit.keys as unknown[] | undefined;
  return edit.edit === "curve" && edit.curve === "jawOpen" && edit.contacts === "free"
    && edit.from !== undefined && edit.to !== undefined && keys?.length === 1;
}

export function laneOf(edit: Edit): Lane | "curve" | null {
  if (edit.edit === "closed" || isOpenMark(edit)) return "lips";
  if (edit.edit === "curve") return "curve";
  return LANES.find((lane) => lane === edit.edit) ?? null;
}

export function newSpan(kind: Lane | "open", start: number, end: number, first: { mood: string; style: string }): Edit {
  const made: Record<string, Record<string, unknown>> = {
    lips: { edit: "closed" },
    open: { edit: "curve", curve: "jawOpen", keys: [[rounded(start), OPEN_WEIGHT]], mode: "add", contacts: "free" },
    mood: { edit: "mood", mood: first.mood },
    style: { edit: "style", style: first.style },
    amplitude: { edit: "amplitude", regions: { jaw: 1.3, lips: 1.2 } },
    gaze: { edit: "gaze", keys: [[rounded(start), [0, 15]]] },
  };
  return withSpan(made[kind] as Edit, start, end);
}

// What is written on the block of an edit.
export function titleOf(edit: Edit): string {
  if (edit.edit === "closed") return "shut";
  if (isOpenMark(edit)) return "open";
  if (edit.edit === "mood") return String(edit.mood);
  if (edit.edit === "style") return String(edit.style);
  if (edit.edit === "amplitude") {
    return Object.entries(edit.regions as Record<string, number>).map(([part, by]) => `${part} ×${by}`).join(", ");
  }
  if (edit.edit === "gaze") {
    const keys = edit.keys as [number, [number, number]][];
    if (keys.length > 1) return `${keys.length} keys`;
    const [[, [down, left]]] = keys;
    const ways = [down && `${Math.abs(down)}° ${down > 0 ? "down" : "up"}`, left && `${Math.abs(left)}° ${left > 0 ? "left" : "right"}`];
    return ways.filter(Boolean).join(", ") || "ahead";
  }
  return edit.edit;
}

// ---- keys of curves

export type Key = [time: number, value: number];
const AROUND_S = 0.25, KEY_BLEND_S = 0.2;

export function keyEdit(project: Project, curve: string): number {
  return project.edits.findIndex((edit) => edit.edit === "curve" && edit.curve === curve && !isOpenMark(edit));
}

export function keysOf(project: Project, curve: string, duration: number): Key[] {
  const edit = project.edits[keyEdit(project, curve)];
  const keys = (edit?.keys ?? []) as [Moment, number][];
  return keys.map(([time, value]) => [secondsOf(time, duration, 0), value]);
}

// A curve has its keys from shortly before the first to shortly after the last; around them it is
// as it was made.
export function withKeys(project: Project, curve: string, keys: Key[], duration: number): Project {
  const index = keyEdit(project, curve);
  if (!keys.length) return index < 0 ? project : withoutEdit(project, index);
  const before = project.edits[index] ?? { edit: "curve", curve, mode: "replace", between: "smooth" };
  const sorted = keys
    .map(([time, value]): Key => [rounded(clamp(time, 0, duration)), Math.round(value * 1000) / 1000])
    .sort(([one], [two]) => one - two)
    .filter(([time], place, all) => !place || time > all[place - 1][0]);
  const around = index < 0 || (before.from !== undefined && before.to !== undefined);
  const [first] = sorted[0], [last] = sorted[sorted.length - 1];
  const span = around
    ? { from: rounded(Math.max(0, first - AROUND_S)), to: rounded(Math.min(duration, last + AROUND_S)), blend: KEY_BLEND_S }
    : {};
  const edit = { ...before, keys: sorted, ...span } as Edit;
  return index < 0 ? withNewEdit(project, edit) : withEdit(project, index, edit);
}

// ---- blinks

export interface Blinks { add: number[]; remove: number[] | "all" }

const blinkEdit = (project: Project) => project.edits.findIndex((edit) => edit.edit === "blinks");

export function blinksOf(project: Project, duration: number): Blinks {
  const edit = project.edits[blinkEdit(project)];
  const times = (list: unknown) => ((list ?? []) as Moment[]).map((each) => secondsOf(each, duration, 0));
  return { add: times(edit?.add), remove: edit?.remove === "all" ? "all" : times(edit?.remove) };
}

export function withBlinks(project: Project, blinks: Blinks): Project {
  const index = blinkEdit(project);
  const { add, remove } = blinks;
  const edit: Edit = { ...project.edits[index], edit: "blinks", add: add.map(rounded).sort((a, b) => a - b), remove };
  if (!add.length) delete edit.add;
  if (remove !== "all" && !remove.length) delete edit.remove;
  if (Object.keys(edit).length === 1) return index < 0 ? project : withoutEdit(project, index);
  return index < 0 ? withNewEdit(project, edit) : withEdit(project, index, edit);
}
