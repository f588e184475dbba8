// The viewer of one take: a head that speaks, in time with its sound.
// The page carries everything; nothing is fetched.
import * as THREE from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { CameraMan } from "./camera.js";
import { Captions } from "./captions.js";
import { Controls } from "./controls.js";
import { CurveBars, curveTable } from "./curves.js";
import { bytesOf, unpacked } from "./files.js";
import { Pace } from "./pace.js";
import { Shading, Shadow } from "./shading.js";
import { Clock, soundOf } from "./sound.js";

const $ = (id) => document.getElementById(id);

function told(error) {
  $("title").textContent = `This take cannot be shown: ${error.message}`;
}

function canvasOf(stage) {
  const renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true, preserveDrawingBuffer: true });
  const canvas = renderer.domElement;
  canvas.tabIndex = 0;
  canvas.setAttribute("role", "img");
  canvas.setAttribute("aria-label", "A speaking head. Drag, or use A, D, W and S, to turn it.");
  $("stage").append(canvas);
  const [middle, margin] = stage.ground.map((colour) => `rgb(${colour.join(" ")})`);
  $("stage").style.background = `radial-gradient(100% 87% at 50% 38%, ${middle}, `
    + `color-mix(in srgb, ${middle}, ${margin}) 50%, ${margin})`;
  return renderer;
}

function meshesOf(scene, shading) {
  const meshes = [];
  scene.traverse((node) => { if (node.isMesh) meshes.push(node); });
  meshes.forEach((mesh) => { mesh.frustumCulled = false; shading.dress(mesh); });
  return meshes;
}

async function start() {
  const take = JSON.parse($("take").textContent);
  const renderer = canvasOf(take.stage);
  const shading = new Shading(take.stage);
  const scene = new THREE.Scene();
  const head = await unpacked(bytesOf("head"));

  new GLTFLoader().parse(head.buffer, "", (gltf) => {
    scene.add(gltf.scene);
    const all = meshesOf(gltf.scene, shading);
    const meshes = all.filter((mesh) => mesh.morphTargetDictionary);
    const shadow = Shadow.possible(renderer) && new Shadow(shading, take.stage.shadow_side);
    const clip = gltf.animations[0];
    const mixer = new THREE.AnimationMixer(gltf.scene);
    if (clip) mixer.clipAction(clip).play();
    const blob = take.sound && new Blob([bytesOf("sound")], { type: take.sound });
    const sound = soundOf(blob, take.duration);
    const camera = new CameraMan(renderer.domElement, take);
    camera.show("front");
    const captions = new Captions($("captions"), take.words);
    const bars = new CurveBars($("curves"), meshes[0]);
    const jump = (time) => { sound.currentTime = Math.max(0, Math.min(take.duration, time)); };

    const pace = new Pace(renderer);
    let posed = null, stale = true;
    // At its very end a clip would begin again.
    const move = (time) => { if (clip) mixer.setTime(Math.min(time, clip.duration - 1e-5)); };
    const pose = (time) => {
      move(time);
      if (shadow) shadow.draw(renderer, scene, all);
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
      take, sound, camera, jump, show, canvas: renderer.domElement, head, blob,
      curveTable: () => {
        const table = curveTable(meshes[0], take, move);
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
    new ResizeObserver(() => { resize(); show(); }).observe($("stage"));
    resize();
    show();
    renderer.setAnimationLoop(show);
    // What a script or a test may want to hold on to.
    window.elocute = { take, sound, meshes, camera, renderer, show, jump };
    document.body.classList.add("ready");
  }, told);
}

start().catch(told);
