// The line above the head: what is open, what was done, and what goes out.
import { signal } from "@preact/signals";
import { useEffect, useRef } from "preact/hooks";
import { Icon, type IconName } from "./icons";
import { finished, jobs, server } from "./server";
import { canRedo, canUndo, close, computing, held, hold, known, listening, name, opening, redo, saved, showing, shown, swap, takeBack, told, trouble, undo, unsaved } from "./studio";

interface ToolProps { icon: IconName; label: string; keys?: string; onClick: () => void; disabled?: boolean; pressed?: boolean }

export function Tool({ icon, label, keys, onClick, disabled, pressed }: ToolProps) {
  return (
    <button type="button" class="icon" aria-label={label} aria-keyshortcuts={keys} disabled={disabled} aria-pressed={pressed} onClick={onClick}>
      <Icon name={icon} />
    </button>
  );
}

// A menu that a press elsewhere, or Escape, closes.
export function Menu({ label, children, icon }: { label: string; children: preact.ComponentChildren; icon?: IconName }) {
  const menu = useRef<HTMLDetailsElement>(null);
  useEffect(() => {
    const shut = (event: Event) => {
      const at = menu.current;
      if (!at?.open) return;
      const escape = event instanceof KeyboardEvent && event.code === "Escape";
      if (escape) at.querySelector("summary")?.focus();
      if (escape || (event.type === "pointerdown" && !at.contains(event.target as Node))) at.open = false;
    };
    for (const kind of ["pointerdown", "keydown"]) addEventListener(kind, shut);
    return () => { for (const kind of ["pointerdown", "keydown"]) removeEventListener(kind, shut); };
  }, []);
  return (
    <details class="menu" ref={menu}>
      <summary aria-label={icon ? label : undefined} class={icon ? "icon" : ""}>{icon ? <Icon name={icon} /> : label}</summary>
      <div>{children}</div>
    </details>
  );
}

// ---- what goes out

interface Out { id: string; format: string; state: string }
const outs = signal<Out[]>([]);
const ABOUT: Record<string, string> = {
  mp4: "film", webm: "film", mov: "film", html: "page that plays", png: "picture", glb: "head that moves", fbx: "head that moves", vrm: "VRM model",
  vrma: "VRM animation", usdz: "head for AR", csv: "curves", json: "curves", npz: "motion", npy: "vertices", obj: "mesh of each frame", ply: "mesh of each frame",
};
const order = (format: string) => (format in ABOUT ? Object.keys(ABOUT).indexOf(format) : Infinity);
const sorted = (formats: string[]) => formats.sort((one, two) => order(one) - order(two));

async function send(format: string) {
  if (!name.value) return;
  try {
    const { job } = await server.export(name.value, format);
    const put = (state: string) => { outs.value = [{ id: job, format, state }, ...outs.value.filter(({ id }) => id !== job)]; };
    put("running");
    const over = await finished(job);
    put(over.state);
    if (over.state === "failed") told(over.error ?? `The ${format} could not be made.`);
  } catch (error) {
    told(error);
  }
}

function Exports() {
  return (
    <Menu label="Export">
      <div class="formats">
        {sorted(Object.keys(known.value?.formats ?? {})).map((format) => (
          <button key={format} type="button" onClick={() => send(format)}>.{format} <small>{ABOUT[format] ?? ""}</small></button>
        ))}
      </div>
      {outs.value.length > 0 && (
        <ul class="outs">
          {outs.value.map(({ id, format, state }) => {
            const job = jobs.value[id];
            return (
              <li key={id}>
                {state !== "done" && <span>.{format}</span>}
                {state === "done" ? <a href={server.fileAddress(id)} download>Save {String(job?.result?.file ?? "")}</a>
                  : state === "running" ? (
                    <>
                      <progress aria-label={`Making .${format}`} value={job?.progress} />
                      <button type="button" class="icon small" aria-label={`Stop making .${format}`} onClick={() => server.cancel(id).catch(told)}><Icon name="cross" /></button>
                    </>
                  ) : <span class="dim">{state === "cancelled" ? "stopped" : "failed"}</span>}
              </li>
            );
          })}
        </ul>
      )}
    </Menu>
  );
}

const KEYS: [string, string][] = [
  ["Space", "play, pause"], ["← →", "a frame; with shift a second"], ["Home, End", "start, end"],
  ["I, O", "start and end of what is looped"], ["L, H", "loop, half speed"], ["Shift ↑ ↓", "zoom in, out"],
  ["Ctrl Z, Ctrl Shift Z", "undo, redo"], ["X", "A or B"], ["Tab", "the next lane"], ["↑ ↓", "the block before, after"],
  [", .", "move its end; with shift its start"], ["Enter", "change it"], ["S, J, Delete", "split, join, remove"],
  ["C, B, K", "lips shut, blink, key of a curve here"], ["Page ↑ ↓", "a key's value"], ["1 2 3 4", "views"], ["A D W S, + −", "turn, nearer (on the head)"],
];

function Status() {
  const job = computing.value && jobs.value[computing.value.job];
  if (listening.value) return <p class="status busy" role="status"><progress aria-label="Writing down" value={listening.value.progress || undefined} /> Writing down what is heard</p>;
  if (opening.value) return <p class="status" role="status">Opening {opening.value}…</p>;
  if (!computing.value) {
    const notes = shown.value?.notes ?? [], state = unsaved.value ? "Not saved" : "Saved";
    return <p class="status" role="status" title={notes.join("\n")}>{saved.value ? [state, ...notes].join("; ") : ""}</p>;
  }
  return <p class="status busy" role="status"><progress aria-label="Making the take" value={job?.progress || undefined} /> Making the take</p>;
}

function AB() {
  if (!held.value) return <button type="button" aria-keyshortcuts="X" onClick={hold}>Compare</button>;
  return (
    <div class="ab" role="group" aria-label="Compare">
      {(["A", "B"] as const).map((each) => (
        <button key={each} type="button" aria-pressed={showing.value === each} aria-keyshortcuts="X" aria-label={each === "A" ? "A, as it was held" : "B, as it is now"} onClick={() => swap(each)}>{each}</button>
      ))}
      <Menu label="Compare">
        <button type="button" onClick={() => { hold(); swap("B"); }}>Hold B as A</button>
        <button type="button" onClick={takeBack}>Continue from A</button>
        <button type="button" onClick={() => { swap("B"); held.value = null; }}>Compare no more</button>
      </Menu>
    </div>
  );
}

export function Bar() {
  const flip = () => {
    const root = document.documentElement;
    root.dataset.theme = root.dataset.theme === "light" ? "dark" : "light";
  };
  return (
    <header class="bar">
      {name.value ? <Tool icon="back" label="All projects" onClick={close} /> : null}
      <h1>{name.value ?? "Elocute studio"}</h1>
      {name.value && (
        <>
          <Status />
          <div class="tools wide-only">
            <Tool icon="undo" label="Undo" keys="Control+Z" disabled={!canUndo.value} onClick={undo} />
            <Tool icon="redo" label="Redo" keys="Control+Shift+Z" disabled={!canRedo.value} onClick={redo} />
            <AB />
          </div>
        </>
      )}
      <div class="tools">
        {name.value && <Exports />}
        <span class="wide-only"><Menu label="Keys" icon="keys"><dl>{KEYS.map(([key, does]) => <><dt>{key}</dt><dd>{does}</dd></>)}</dl></Menu></span>
        <Tool icon="theme" label="Dark or light" onClick={flip} />
      </div>
      {trouble.value && (
        <p class="trouble" role="alert"><span>{trouble.value}</span><button type="button" class="icon small" aria-label="Close" onClick={() => { trouble.value = null; }}><Icon name="cross" /></button></p>
      )}
    </header>
  );
}
