// The viewer of one take: a head that speaks, in time with its sound.
// The page carries everything; nothing is fetched.
import * as THREE from "three";
import { CameraMan } from "./camera.js";
import { Captions } from "./captions.js";
import { Controls } from "./controls.js";
import { CurveBars, curveTable } from "./curves.js";
import { bytesOf, unpacked } from "./files.js";
import { foldsOf } from "./folds.js";
import { Head } from "./head.js";
import { mouthOf } from "./mouth.js";
import { Pace } from "./pace.js";
import { Shading, Shadow } from "./shading.js";
import { Clock, soundOf } from "./sound.js";

const $ = (id) => document.getElementById(id);

function told(error) {
  document.body.classList.add("failed");
  $("title").textContent = `This take cannot be shown: ${error.message}`;
}

// A colour of three numbers to 255, by its luma: the controls go with the picture above them.
const bright = ([red, green, blue]) => 0.3 * red + 0.59 * green + 0.11 * blue > 128;

// What lies behind the head, as `ground` of the pictures' GLSL has it.
function spot([middle, margin]) {
  const stops = Array.from({ length: 9 }, (_, step) => {
    const away = step / 8, share = away * away * (3 - 2 * away);
    return `rgb(${middle.map((from, index) => (from + share * (margin[index] - from)).toFixed(1)).join(" ")})`;
  });
  return `radial-gradient(100% 87% at 50% 38%, ${stops})`;
}

function canvasOf(stage) {
  const renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true, preserveDrawingBuffer: true });
  const canvas = renderer.domElement;
  canvas.tabIndex = 0;
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", "A speaking head. Drag, or use A, D, W and S, to turn it.");
  $("stage").append(canvas);
  $("stage").style.setProperty("--ground", spot(stage.ground));
  if (stage.light_ground) $("stage").style.setProperty("--light-ground", spot(stage.light_ground));
  document.documentElement.dataset.theme = bright(stage.ground[1]) ? "light" : "dark";
  return renderer;
}

// Once all that was asked of the graphics is done.
async function drawn(gl) {
  const done = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
  gl.flush();
  while (gl.clientWaitSync(done, 0, 0) === gl.TIMEOUT_EXPIRED) {
    await new Promise((next) => { setTimeout(next, 4); });
  }
  gl.deleteSync(done);
}

async function start() {
  const take = JSON.parse($("take").textContent);
  const renderer = canvasOf(take.stage);
  const shading = new Shading(take.stage);
  const head = new Head(await unpacked(bytesOf("head")), take.fps);
  const { scene, meshes } = head;
  const pictures = await head.pictures();
  const folds = foldsOf(meshes, take.stage.folds, pictures);
  const mouth = mouthOf(meshes, take.stage.mouth);
  meshes.forEach((mesh) => shading.dress(mesh, pictures, folds, mouth));
  const shadow = Shadow.possible(renderer) && new Shadow(shading, take.stage.shadow_side);
  const blob = take.sound && new Blob([bytesOf("sound")], { type: take.sound });
  const sound = soundOf(blob, take.duration);
  const camera = new CameraMan(renderer.domElement, take);
  camera.show("front");
  const captions = new Captions($("captions"), take.words);
  const bars = new CurveBars($("curves"), meshes[0]);
  const jump = (time) => { sound.currentTime = Math.max(0, Math.min(take.duration, time)); };

  const pace = new Pace(renderer);
  let posed = null, stale = true;
  const pose = (time) => {
    head.pose(time);
    folds?.update();
    mouth.update();
    if (shadow) shadow.draw(renderer, scene, meshes);
    bars.show();
    captions.show(time);
    posed = time;
    stale = true;
  };
  // A picture is drawn where it would differ from the one that is there.
  const show = () => {
    const time = Math.min(sound.currentTime, take.duration);
    if (sound instanceof Clock && sound.ended && !sound.paused) sound.pause();
    controls.show(time);
    if (time !== posed) pose(time);
    if (camera.update()) stale = true;
    if (pace.tick(stale)) stale = true;
    if (stale) renderer.render(scene, camera.camera);
    stale = false;
  };
  const controls = new Controls({
    take, sound, camera, jump, show, canvas: renderer.domElement, head: head.bytes, blob,
    curveTable: () => {
      const table = curveTable(meshes[0], take, (time) => head.at(time));
      posed = null;
      return table;
    },
  });
  const resize = () => {
    const { clientWidth: width, clientHeight: height } = $("stage");
    if (!width || !height) return;
    renderer.setSize(width, height);
    camera.resize(width, height);
    stale = true;
  };
  resize();
  show();
  await drawn(renderer.getContext());
  performance.mark("drawn");
  new ResizeObserver(() => { resize(); show(); }).observe($("stage"));
  renderer.setAnimationLoop(show);
  // What a script or a test may want to hold on to.
  window.elocute = { take, sound, meshes, folds, mouth, camera, renderer, show, jump };
  document.body.classList.add("ready");
}

start().catch(told);
