// The page of `elocute live`: a head that shows what the server sends, and hears the microphone.
import { LiveFace } from "../live-client/index.js";
import { CameraMan } from "./camera.js";
import { Pace } from "./pace.js";
import { Stage } from "./stage.js";

const $ = (id) => document.getElementById(id);

function told(text) { $("state").textContent = text; }

// Speak into the microphone, or stop; browsers let a page be heard after a click alone.
function microphone(face) {
  let stop = null;
  $("microphone").onclick = async () => {
    try {
      if (stop) stop = stop();
      else stop = await face.microphone();
    } catch (error) {
      told(`No microphone: ${error.message}`);
    }
    $("microphone").setAttribute("aria-pressed", String(Boolean(stop)));
  };
}

async function start() {
  const take = JSON.parse($("take").textContent);
  const stage = new Stage($("stage"), take.stage);
  const { head, renderer } = await stage.dress(take.fps);
  const camera = new CameraMan(renderer.domElement, take);
  camera.show("front");
  const pace = new Pace(renderer);
  const asked = new URLSearchParams(location.hash.slice(1));
  const context = new AudioContext();
  const url = `${location.protocol.replace("http", "ws")}//${location.host}/live`;
  const face = new LiveFace(url, { shapes: "elocute", context, token: asked.get("token") ?? "", face: asked.get("face") ?? "main" });
  const joints = Object.fromEntries(take.joints.map((name, at) => [name, head.joint(at)]));
  face.attach(head.meshes[0], joints);
  face.addEventListener("welcome", () => told("Waiting for speech"));
  face.addEventListener("frame", () => told("Live"));
  face.addEventListener("closed", () => told("Not connected"));
  face.addEventListener("error", (event) => told(/** @type {CustomEvent} */ (event).detail.message));
  microphone(face);
  document.addEventListener("pointerdown", () => context.resume());
  const show = () => {
    face.update();
    head.move();
    stage.moved();
    camera.update();
    pace.tick(true);
    stage.draw(camera.camera);
  };
  new ResizeObserver(() => { stage.resize(camera); show(); }).observe($("stage"));
  stage.resize(camera);
  show();
  await stage.drawn();
  renderer.setAnimationLoop(show);
  window.elocute = { face, meshes: head.meshes, joints, show, camera };
  document.body.classList.add("ready");
}

start().catch((error) => told(`This page cannot be shown: ${error.message}`));
