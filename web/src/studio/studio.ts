// What is open, what was done to it, and what of it is computed.
import { batch, computed, signal } from "@preact/signals";
import { type Player, range, type Take } from "./player";
import type { Label, Project, Tier } from "./project";
import { finished, jobs, type Listed, type Peaks, Refusal, server, type ServerState } from "./server";

export type Selection =
  | { kind: Tier; index: number }
  | { kind: "edit"; index: number }
  | { kind: "key"; curve: string; index: number }
  | { kind: "blink"; time: number; made: boolean };

interface Version { project: Project; take: Take }

export const known = signal<ServerState | null>(null);
export const list = signal<Listed[]>([]);
export const name = signal<string | null>(null);
export const saved = signal<Project | null>(null);
export const draft = signal<Project | null>(null); // while something is dragged
export const take = signal<Take | null>(null);
export const peaks = signal<Peaks | null>(null);
export const held = signal<Version | null>(null); // A; what is worked on is B
export const showing = signal<"A" | "B">("B");
export const selection = signal<Selection | null>(null);
export const trouble = signal<string | null>(null);
export const computing = signal<{ job: string } | null>(null);
// The job that writes down what is heard.
export const listening = computed(() => Object.values(jobs.value).find((job) =>
  job.what === "transcribe" && job.project === name.value && (job.state === "running" || job.state === "queued")));
export const opening = signal<string | null>(null);
export const unsaved = signal(false);
const past = signal<Project[]>([]), future = signal<Project[]>([]);
export const canUndo = computed(() => past.value.length > 0);
export const canRedo = computed(() => future.value.length > 0);

// What is looked at: A stays as it was held.
export const project = computed(() =>
  (showing.value === "A" && held.value ? held.value.project : draft.value ?? saved.value));
export const shown = computed(() => (showing.value === "A" ? held.value?.take ?? take.value : take.value));
export const duration = computed(() => take.value?.duration_s ?? 0);
export const phones = computed(() => labelsOf("phones"));
export const words = computed(() => labelsOf("words"));
export const styles = computed(() => {
  const asked = project.value?.settings.model ?? known.value?.settings.find((each) => each.name === "model")?.default;
  return known.value?.models[String(asked)]?.styles ?? [];
});

function labelsOf(tier: Tier): Label[] {
  return project.value?.[tier] ?? shown.value?.[tier] ?? [];
}

export function told(error: unknown) {
  trouble.value = error instanceof Error ? error.message : String(error);
}

let player: Player;
export const setPlayer = (made: Player) => { player = made; };
export const thePlayer = () => player;

// ---- what is there

export async function begin() {
  await Promise.all([
    server.state().then((found) => { known.value = found; }),
    server.projects().then((found) => { list.value = found; }),
  ]);
}

let revision = "";

export async function open(asked: string) {
  trouble.value = null;
  opening.value = asked;
  try {
    const [found, etag] = await server.project(asked);
    revision = etag;
    batch(() => {
      name.value = asked;
      saved.value = found;
      draft.value = take.value = held.value = selection.value = peaks.value = range.value = null;
      showing.value = "B";
      past.value = future.value = [];
    });
    history.replaceState(null, "", `#${encodeURIComponent(asked)}`);
    await compute();
  } catch (error) {
    told(error);
  } finally {
    opening.value = null;
  }
}

export async function close() {
  player.silence();
  batch(() => {
    name.value = saved.value = draft.value = take.value = held.value = selection.value = trouble.value = null;
  });
  history.replaceState(null, "", location.pathname);
  await begin().catch(told);
}

async function opened(making: Promise<{ name: string }>, called: string) {
  trouble.value = null;
  opening.value = called;
  try {
    await open((await making).name);
  } catch (error) {
    told(error);
  } finally {
    opening.value = null;
  }
}

export const upload = (file: Blob, called: string) => opened(server.upload(file, called), called);
export const fromFolder = (file: string) => opened(server.ofFolder(file), file);

// The words that are heard become the text, where nobody wrote another meanwhile.
export async function transcribe() {
  const called = name.value, before = saved.value?.text;
  if (!called || listening.value) return;
  try {
    const { job } = await server.transcribe(called);
    const over = await finished(job);
    if (over.state === "failed") throw new Refusal(over.error ?? "No words were found.", 422);
    const text = over.result.text;
    if (over.state !== "done" || !text || name.value !== called || !saved.value || saved.value.text !== before) return;
    change({ ...saved.value, text: String(text), phones: null, words: null });
  } catch (error) {
    told(error);
  }
}

// ---- what is done

// One step: it can be undone, is saved, and the take is made anew.
export function change(next: Project) {
  const before = saved.value;
  if (!before || next === before) { draft.value = null; return; }
  batch(() => {
    past.value = [...past.value, before];
    future.value = [];
    settle(next);
  });
}

function settle(next: Project) {
  saved.value = next;
  draft.value = null;
  showing.value = "B";
  trouble.value = null;
  unsaved.value = true;
  compute().catch(told);
}

function travel(from: typeof past, to: typeof past) {
  const next = from.value.at(-1), here = saved.value;
  if (!next || !here) return;
  batch(() => {
    from.value = from.value.slice(0, -1);
    to.value = [...to.value, here];
    selection.value = null;
    settle(next);
  });
}

export const undo = () => travel(past, future);
export const redo = () => travel(future, past);

// Somebody else saved the project: theirs is shown, and what was here is a step to undo.
export async function changedElsewhere(called: string, now: string) {
  if (called !== name.value || saving || `"${now}"` === revision) return;
  await reload().catch(told);
}

async function reload() {
  const called = name.value, before = saved.value;
  if (!called || !before) return;
  const [found, etag] = await server.project(called);
  if (name.value !== called || etag === revision) return;
  batch(() => {
    past.value = [...past.value, before];
    saved.value = found;
    draft.value = selection.value = null;
  });
  revision = etag;
  unsaved.value = false;
  compute().catch(told);
}

// ---- what is computed

let wanted = 0, saving = false, atWork: Promise<void> | null = null;

// The take of what is there; called while one is made, that one is given up.
export function compute(): Promise<void> {
  wanted += 1;
  if (computing.value?.job) server.cancel(computing.value.job).catch(() => {});
  atWork ??= work().finally(() => { atWork = null; computing.value = null; });
  return atWork;
}

async function work() {
  for (let done = 0; done !== wanted;) {
    done = wanted;
    const called = name.value;
    if (!called) return;
    computing.value = { job: "" };
    try {
      if (unsaved.value) await save(called);
      const { job } = await server.compute(called);
      computing.value = { job };
      const over = await finished(job);
      if (done !== wanted || over.state === "cancelled") continue;
      if (over.state === "failed") throw new Refusal(over.error ?? "The take could not be made.", 422);
      await load(called, over.result.take);
    } catch (error) {
      if (done === wanted) throw error;
    }
  }
}

async function save(called: string) {
  const state = saved.value;
  if (!state) return;
  saving = true;
  try {
    revision = await server.save(called, state, revision);
    if (saved.value === state) unsaved.value = false;
  } catch (error) {
    const status = error instanceof Refusal ? error.status : 0;
    if (status !== 409 && status !== 422) throw error;
    told(error);
    if (status === 409) await reload();
    else if (saved.value === state) takeBackStep();
  } finally {
    saving = false;
  }
}

// What the server refuses was not done.
function takeBackStep() {
  const before = past.value.at(-1);
  if (!before) return;
  batch(() => {
    past.value = past.value.slice(0, -1);
    saved.value = before;
    selection.value = null;
    unsaved.value = false;
  });
}

// The server is there again.
export function again() {
  if (unsaved.value) compute().catch(told);
}

async function load(called: string, digest: unknown) {
  const record = await server.take(digest);
  const light = String(saved.value?.options?.light ?? "studio");
  const { weights_url, moves_url, joints_url } = record;
  const [weights, turns] = await Promise.all([server.floats(weights_url), server.floats(joints_url)]);
  const moves = moves_url === weights_url ? weights : await server.floats(moves_url);
  if (name.value !== called) return;
  player.hear(record.sound_url, record.duration_s);
  const made: Take = { ...record, light, weights, moves, turns };
  const first = peaks.value === null;
  batch(() => {
    take.value = made;
    if (first) peaks.value = { per_second: 1, min: [], max: [] };
  });
  if (first) server.peaks(record.peaks_url).then((found) => { peaks.value = found; }).catch(told);
  if (showing.value === "B") await player.wear(made);
}

// ---- two of one

export function hold() {
  if (saved.value && take.value) held.value = { project: saved.value, take: take.value };
}

export async function swap(to: "A" | "B" = showing.value === "A" ? "B" : "A") {
  if (!held.value) return;
  showing.value = to;
  if (shown.value) await player.wear(shown.value).catch(told);
}

// Work goes on from A.
export function takeBack() {
  if (held.value) change(held.value.project);
}
