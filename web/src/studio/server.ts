// What the page asks of its server, and what it is told of jobs.
import { signal } from "@preact/signals";
import { EMPTY, type Label, type Project } from "./project";

export interface Setting {
  name: string; help: string; default: unknown; low: number | null; high: number | null; choices: string[];
}

export interface ServerState {
  version: string;
  models: Record<string, { about: string; styles: string[] }>;
  moods: string[]; identities: string[]; looks: string[]; lights: string[]; phones: string[];
  formats: Record<string, Setting[]>;
  settings: Setting[];
  characters: string[]; // suffixes
  shapes: string[]; // names of which one may say that a shape of a character does the same
  extras: Record<string, boolean>;
  sounds: string[]; // of the folder, without a project
  opens: string; // the project to begin with
}

export interface Listed { name: string; duration_s: number | null; text: string | null; modified: number }

export interface TakeRecord {
  fps: number; frames: number; duration_s: number; shapes: string[]; joints: string[];
  phones: Label[]; words: Label[]; contacts: [number, number][]; // when lips are sealed
  head_key: string; head_url: string; weights_url: string; moves_url: string; joints_url: string; sound_url: string; peaks_url: string;
  character: string | null; notes: string[];
}

export interface HeadRecord { stage: unknown; views: Record<string, unknown>; field_deg: number; joints: string[] }

export interface Job {
  id: string; state: "queued" | "running" | "done" | "failed" | "cancelled";
  progress: number; what: string; project: string; error: string | null; result: Record<string, unknown>;
}

export interface Peaks { per_second: number; min: number[]; max: number[] }

export type Does = string | Record<string, number> | null; // null: left alone

export interface Report {
  name: string; mapped: Record<string, string>; fitted: Record<string, string>; idle: Record<string, string>;
  unknown: Record<string, string>; // the nearest name that is known, or ""
  names: Record<string, Does>; // what was said of its shapes
  missing: string[]; notes: string[];
}

// What the server says in one line.
export class Refusal extends Error {
  constructor(line: string, readonly status: number) { super(line); }
}

async function answered(path: string, init?: RequestInit): Promise<Response> {
  let answer: Response;
  try {
    answer = await fetch(path, init);
  } catch {
    throw new Refusal("The server does not answer. Is `elocute studio` still running?", 0);
  }
  if (answer.ok) return answer;
  const told = await answer.json().catch(() => null);
  const line = typeof told?.error === "string" ? told.error : `The server says ${answer.status} to ${path}.`;
  throw new Refusal(line, answer.status);
}

async function asked<T>(path: string, init?: RequestInit): Promise<T> {
  return (await answered(path, init)).json();
}

const JSON_BODY = { "Content-Type": "application/json" };
const at = (name: string) => `/api/projects/${encodeURIComponent(name)}`;
const sent = (method: string, body: unknown): RequestInit =>
  ({ method, body: JSON.stringify(body), headers: JSON_BODY });

export const server = {
  state: () => asked<ServerState>("/api/state"),
  projects: () => asked<Listed[]>("/api/projects"),
  upload: (file: Blob, name: string) =>
    asked<{ name: string }>(`/api/projects?name=${encodeURIComponent(name)}`, { method: "POST", body: file }),
  ofFolder: (file: string) => asked<{ name: string }>(`/api/projects?file=${encodeURIComponent(file)}`, { method: "POST" }),
  project: async (name: string): Promise<[Project, string]> => {
    const answer = await answered(at(name));
    return [{ ...EMPTY, ...await answer.json() }, answer.headers.get("etag") ?? ""];
  },
  save: async (name: string, project: Project, revision: string): Promise<string> => {
    const asking = sent("PUT", project);
    const answer = await answered(at(name), { ...asking, headers: { ...JSON_BODY, "If-Match": revision } });
    return answer.headers.get("etag") ?? "";
  },
  compute: (name: string) => asked<{ job: string }>(`${at(name)}/take`, sent("POST", {})),
  transcribe: (name: string) => asked<{ job: string }>(`${at(name)}/transcribe`, sent("POST", {})),
  take: (digest: unknown) => asked<TakeRecord>(`/api/takes/${digest}`),
  floats: async (address: string) => new Float32Array(await (await answered(address)).arrayBuffer()),
  peaks: (address: string) => asked<Peaks>(address),
  stage: (key: string, light: string) => asked<HeadRecord>(`/api/heads/${key}${light === "studio" ? "" : `.${light}`}.json`),
  bytes: async (address: string) => new Uint8Array(await (await answered(address)).arrayBuffer()),
  export: (name: string, format: string, options: Record<string, unknown> = {}) =>
    asked<{ job: string }>(`${at(name)}/export`, sent("POST", { format, options })),
  job: (id: string) => asked<Job>(`/api/jobs/${id}`),
  cancel: (id: string) => answered(`/api/jobs/${id}`, { method: "DELETE" }),
  fileAddress: (id: string) => `/api/jobs/${id}/file`,
  character: (name: string) => asked<Report>(`/api/characters/${encodeURIComponent(name)}`),
  addCharacter: (file: Blob, name: string) =>
    asked<Report>(`/api/characters?name=${encodeURIComponent(name)}`, { method: "POST", body: file }),
  nameShapes: (name: string, names: Report["names"]) =>
    asked<Report>(`/api/characters/${encodeURIComponent(name)}/names`, sent("PUT", names)),
};

// ---- jobs: told as they change; asked where nothing is told

const OVER = new Set(["done", "failed", "cancelled"]);
const ASK_MS = 1000, AGAIN_MS = 2000;
export const jobs = signal<Record<string, Job>>({});
interface Saved { id: string; what: "project"; project: string; revision: string }

function heard(job: Job) {
  jobs.value = { ...jobs.value, [job.id]: job };
}

// changed: called when a project was saved, by whomever; there: when the server is there (again).
export function listen(changed: (name: string, revision: string) => void, there: () => void) {
  const socket = new WebSocket(`${location.protocol.replace("http", "ws")}//${location.host}/api/events`);
  socket.onmessage = ({ data }) => {
    const told: Job | Saved = JSON.parse(data);
    if ("revision" in told) changed(told.project, told.revision);
    else heard(told);
  };
  socket.onopen = there;
  socket.onclose = () => setTimeout(listen, AGAIN_MS, changed, there);
}

// Resolves once a job is over.
export async function finished(id: string): Promise<Job> {
  for (;;) {
    const known = jobs.value[id];
    if (known && OVER.has(known.state)) return known;
    await new Promise<void>((done) => {
      const stop = jobs.subscribe((all) => { if (all[id] && OVER.has(all[id].state)) go(); });
      const timer = setTimeout(() => server.job(id).then(heard).finally(go), ASK_MS);
      function go() { clearTimeout(timer); queueMicrotask(() => stop()); done(); }
    });
  }
}
