// The first screen: something to speak, or what was made before.
import { signal } from "@preact/signals";
import { clockText } from "../controls.js";
import { Icon } from "./icons";
import { record, recording } from "./microphone";
import { fromFolder, known, list, open, opening, told, upload } from "./studio";

const writing = signal(false);

function Write() {
  const say = (event: SubmitEvent) => {
    event.preventDefault();
    const text = new FormData(event.currentTarget as HTMLFormElement).get("said") as string;
    if (!text.trim()) return;
    const called = text.trim().split(/\s+/).slice(0, 4).join(" ").replace(/[^\p{L}\p{N} ]/gu, "").trim() || "text";
    upload(new Blob([text], { type: "text/plain" }), `${called}.txt`);
  };
  return (
    <form class="write" onSubmit={say}>
      <label class="field"><span>What is to be said</span><textarea name="said" rows={3} required ref={(at) => at?.focus()} /></label>
      <button type="submit" class="first">Speak</button>
    </form>
  );
}

export function Start() {
  const busy = opening.value !== null;
  const microphone = async () => {
    try { await record((sound) => upload(sound, `recording ${new Date().toISOString().slice(0, 19).replace(/[T:]/g, "-")}.wav`)); }
    catch (error) { told(`No microphone: ${(error as Error).message}`); }
  };
  return (
    <main class="start">
      <section class="drop" aria-label="Something new">
        <p class="call">{busy ? `Opening ${opening.value}…` : "Drop a sound, a video or a text"}</p>
        {!busy && <p class="dim">A head speaks it within seconds. All of it stays on this computer.</p>}
        {busy ? <progress aria-label="Opening" /> : (
          <div class="keys">
            <label class="button first"><Icon name="file" /> Choose a file<input class="unseen" type="file" accept="audio/*,video/*,.txt" onChange={({ currentTarget }) => { if (currentTarget.files?.[0]) upload(currentTarget.files[0], currentTarget.files[0].name); currentTarget.value = ""; }} /></label>
            <button type="button" id="record" aria-pressed={recording.value !== null} onClick={microphone}><Icon name="microphone" /> {recording.value === null ? "Record" : `Stop ${clockText(recording.value)}`}</button>
            <button type="button" aria-expanded={writing.value} onClick={() => { writing.value = !writing.value; }}><Icon name="text" /> Write a text</button>
          </div>
        )}
        {writing.value && !busy && <Write />}
      </section>
      {list.value.length > 0 && (
        <section class="projects" aria-label="Projects">
          <h2>Projects</h2>
          <ul>
            {list.value.map(({ name, duration_s, text }) => (
              <li key={name}>
                <button type="button" onClick={() => open(name)} disabled={busy}>
                  <b>{name}</b> <span class="dim">{text ?? ""}</span> <span class="dim time">{duration_s === null ? "" : clockText(duration_s)}</span>
                </button>
              </li>
            ))}
          </ul>
        </section>
      )}
      {known.value && known.value.sounds.length > 0 && (
        <section class="projects" aria-label="Sounds of this folder">
          <h2>Sounds of this folder</h2>
          <ul>
            {known.value.sounds.map((file) => <li key={file}><button type="button" onClick={() => fromFolder(file)} disabled={busy}>{file}</button></li>)}
          </ul>
        </section>
      )}
      {!known.value && <p class="dim" role="status">Loading…</p>}
    </main>
  );
}
