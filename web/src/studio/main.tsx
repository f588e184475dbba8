// The page of `elocute studio`. It holds no truth of its own: it edits a project, the server makes
// a take of it, and the viewer's head shows that.
import { signal } from "@preact/signals";
import { render } from "preact";
import { useEffect, useRef } from "preact/hooks";
import { Captions } from "../captions.js";
import { Hints } from "../hints.js";
import { Bar } from "./bar";
import { watchTheme } from "./drawing";
import { key } from "./keyboard";
import { dress, Panel } from "./panel";
import { now, Player, playing, range } from "./player";
import { jobs, listen, server } from "./server";
import { Start } from "./start";
import * as studio from "./studio";
import { Timeline } from "./timeline";
import { Transport } from "./transport";

const CHARACTERS = /\.(glb|gltf|vrm|fbx|obj)$/i;
const over = signal(false); // whether a file is held above the page

function dropped(event: DragEvent) {
  event.preventDefault();
  over.value = false;
  const files = [...event.dataTransfer?.files ?? []];
  const character = files.find(({ name }) => CHARACTERS.test(name)), [first, ...rest] = files.filter((file) => file !== character);
  if (first) rest.reduce((before, file) => before.then(() => addFile(file)), takeFile(first));
  else if (character && studio.saved.value) dress(character);
  else if (character) studio.told("Drop a sound, a video or a text first, then the character that is to speak it.");
}

const takeFile = (file: File) => studio.upload(file, file.name);
// Of several, the first is opened.
const addFile = (file: File) => server.upload(file, file.name).then(() => {}, studio.told);

// The words at their time, as the viewer shows them.
function Said() {
  const room = useRef<HTMLDivElement>(null), labels = studio.words.value;
  useEffect(() => {
    const captions = new Captions(room.current!, labels.map(([start, end, text], index) => [start, end, text, index ? " " : ""]));
    return now.subscribe((time) => captions.show(time));
  }, [labels]);
  return <div class="captions" ref={room} />;
}

function Wait() {
  if (studio.trouble.value) return <p class="wait dim">No take yet</p>;
  const job = jobs.value[studio.computing.value?.job ?? ""];
  return <p class="wait" role="status">Listening to the sound…<progress aria-label="Listening" value={job?.progress || undefined} /></p>;
}

function Page() {
  const room = useRef<HTMLDivElement>(null);
  useEffect(() => { studio.setPlayer(new Player(room.current!)); begin(); }, []);
  const working = studio.name.value !== null;
  document.body.classList.toggle("playing", playing.value);
  return (
    <div class={`studio ${working ? "working" : ""} ${over.value ? "over" : ""}`}
      onDragOver={(event) => { event.preventDefault(); over.value = true; }}
      onDragLeave={(event) => { if (!event.relatedTarget) over.value = false; }} onDrop={dropped}>
      <Bar />
      {!working && <Start />}
      <main class="work" hidden={!working}>
        <div class="stage" ref={room}>
          {working && !studio.take.value && <Wait />}
          {studio.showing.value === "A" && <p class="which">A</p>}
          <Said />
        </div>
        {working && <Panel />}
        {studio.take.value && <Transport />}
        {studio.take.value && <Timeline />}
      </main>
      <div id="hint" aria-hidden="true" />
    </div>
  );
}

async function begin() {
  document.documentElement.dataset.theme ??= matchMedia("(prefers-color-scheme: light)").matches ? "light" : "dark";
  watchTheme();
  listen(studio.changedElsewhere, studio.again);
  addEventListener("beforeunload", (event) => { if (studio.unsaved.value) event.preventDefault(); });
  new Hints(document.getElementById("hint"));
  addEventListener("keydown", key);
  // The token of the link is a cookie now.
  history.replaceState(null, "", location.pathname + location.hash);
  await studio.begin();
  const asked = location.hash.slice(1) || encodeURIComponent(studio.known.value?.opens ?? "");
  const found = studio.list.value.find(({ name }) => encodeURIComponent(name) === asked);
  if (found) await studio.open(found.name);
  document.body.classList.add("ready");
  // What a script or a test may want to hold on to.
  window.elocute = { studio, player: studio.thePlayer(), now, range };
}

const page = document.getElementById("page")!;
page.replaceChildren(); // what stood there until this script came
render(<Page />, page);
addEventListener("unhandledrejection", ({ reason }) => studio.told(reason));
