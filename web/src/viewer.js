// The viewer of one take: a head that speaks, in time with its sound.
// The page carries everything; nothing is fetched.
import { CameraMan } from "./camera.js";
import { Captions } from "./captions.js";
import { Controls } from "./controls.js";
import { CurveBars, curveTable } from "./curves.js";
import { bytesOf } from "./files.js";
import { Pace } from "./pace.js";
import { Clock, soundOf } from "./sound.js";
import { Stage } from "./stage.js";

/** @type {(id: string) => any} */
const $ = (id) => document.getElementById(id);

function told(error) {
  document.body.classList.add("failed");
  $("title").textContent = `This take cannot be shown: ${error.message}`;
}

async function start() {
  const take = JSON.parse($("take").textContent);
  const stage = new Stage($("stage"), take.stage);
  const { head, meshes, folds, mouth } = await stage.dress(take.fps);
  const { renderer } = stage;
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
    stage.moved();
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
    if (stale) stage.draw(camera.camera);
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
    if (stage.resize(camera)) stale = true;
  };
  resize();
  show();
  await stage.drawn();
  performance.mark("drawn");
  new ResizeObserver(() => { resize(); show(); }).observe($("stage"));
  renderer.setAnimationLoop(show);
  // What a script or a test may want to hold on to.
  window.elocute = { take, sound, meshes, folds, mouth, camera, renderer, show, jump };
  document.body.classList.add("ready");
}

start().catch(told);
