// The viewer of one take: a head that speaks, in time with its sound.
// The page carries everything; nothing is fetched.
import * as THREE from "three";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";
import { Captions } from "./captions.js";
import { Clock, soundOf } from "./sound.js";

const $ = (id) => document.getElementById(id);
const SHOWN_CURVES = [
  "jawOpen", "mouthClose", "mouthPucker", "mouthFunnel", "mouthLabiodental", "mouthStretchLeft",
  "tongueTipUp", "eyeBlinkLeft",
];

function bytesOf(id) {
  const text = $(id).textContent.trim();
  return Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
}

function studio(scene) {
  const lamp = (color, strength, x, y, z) => {
    const light = new THREE.DirectionalLight(color, strength);
    light.position.set(x, y, z);
    scene.add(light);
  };
  lamp(0xffeedd, 2.6, -0.55, 0.6, 0.8);
  lamp(0xdde6ff, 1.3, 0.85, 0.1, 0.6);
  lamp(0xf4f4ff, 1.6, 0.45, 0.65, -0.75);
  lamp(0xe8ecff, 0.8, -0.8, 0.25, -0.6);
  scene.add(new THREE.HemisphereLight(0xccd2dd, 0x8a7a70, 1.5));
}

function frameHead(camera, controls, box) {
  const size = box.getSize(new THREE.Vector3());
  const top = box.max.y + 0.02;
  const bottom = Math.max(box.min.y + 0.015, top - 0.31);
  controls.target.set(0, (top + bottom) / 2, box.max.z - 0.1);
  const tall = ((top - bottom) / 2) * 1.08 / Math.tan(THREE.MathUtils.degToRad(camera.fov / 2));
  const wide = (size.x / 2) * 1.1 / Math.tan(THREE.MathUtils.degToRad(camera.fov / 2)) / camera.aspect;
  camera.position.copy(controls.target).add(new THREE.Vector3(0, 0.01, Math.max(tall, wide)));
  controls.update();
}

function bars(mesh) {
  const names = Object.keys(mesh.morphTargetDictionary);
  const rows = SHOWN_CURVES.filter((name) => names.includes(name)).map((name) => {
    const row = document.createElement("div");
    const label = document.createElement("span");
    const bar = document.createElement("i");
    label.textContent = name;
    row.append(label, bar);
    $("curves").append(row);
    return [bar, mesh.morphTargetDictionary[name]];
  });
  return () => rows.forEach(([bar, index]) => {
    bar.style.transform = `scaleX(${mesh.morphTargetInfluences[index].toFixed(3)})`;
  });
}

function clockText(seconds) {
  const whole = Math.floor(seconds);
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}.${Math.floor((seconds % 1) * 10)}`;
}

function start() {
  const take = JSON.parse($("take").textContent);
  const renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true, preserveDrawingBuffer: true });
  renderer.toneMapping = THREE.ACESFilmicToneMapping;
  renderer.toneMappingExposure = 1.15;
  renderer.setPixelRatio(Math.min(devicePixelRatio, 2));
  renderer.domElement.setAttribute("aria-label", "A speaking head; drag to turn it");
  $("stage").append(renderer.domElement);
  const scene = new THREE.Scene();
  studio(scene);
  const camera = new THREE.PerspectiveCamera(18, 1, 0.05, 10);
  const controls = new OrbitControls(camera, renderer.domElement);
  controls.enableDamping = true;
  controls.minDistance = 0.15;
  controls.maxDistance = 3;

  new GLTFLoader().parse(bytesOf("head").buffer, "", (gltf) => {
    scene.add(gltf.scene);
    const meshes = [];
    gltf.scene.traverse((node) => {
      if (node.isMesh) { node.frustumCulled = false; if (node.morphTargetDictionary) meshes.push(node); }
    });
    const clip = gltf.animations[0];
    const mixer = new THREE.AnimationMixer(gltf.scene);
    if (clip) mixer.clipAction(clip).play();
    const sound = soundOf(
      take.sound && new Blob([bytesOf("sound")], { type: take.sound }), take.duration,
    );
    const captions = new Captions($("captions"), take.words);
    const box = new THREE.Box3(new THREE.Vector3(...take.low), new THREE.Vector3(...take.high));
    const draw = meshes.length ? bars(meshes[0]) : () => {};
    const seek = $("seek");
    seek.max = take.duration;

    const resize = () => {
      const { clientWidth: width, clientHeight: height } = $("stage");
      renderer.setSize(width, height);
      camera.aspect = width / height;
      camera.updateProjectionMatrix();
      frameHead(camera, controls, box);
    };
    const toggle = () => (sound.paused || sound.ended ? sound.play() : sound.pause());
    const jump = (time) => { sound.currentTime = Math.max(0, Math.min(take.duration, time)); };
    $("play").onclick = toggle;
    seek.oninput = () => jump(Number(seek.value));
    $("volume").oninput = () => { sound.volume = Number($("volume").value); };
    $("speed").onchange = () => { sound.playbackRate = Number($("speed").value); };
    $("reset").onclick = () => frameHead(camera, controls, box);
    $("more").onclick = () => {
      const shown = document.body.classList.toggle("curves");
      $("more").setAttribute("aria-expanded", String(shown));
    };
    addEventListener("resize", resize);
    addEventListener("keydown", (event) => {
      if (/input|select|button/i.test(event.target.tagName) && event.code === "Space") return;
      const step = event.shiftKey ? 1 : 1 / take.fps;
      if (event.code === "Space") { event.preventDefault(); toggle(); }
      if (event.code === "ArrowLeft" && event.target.tagName !== "INPUT") jump(sound.currentTime - step);
      if (event.code === "ArrowRight" && event.target.tagName !== "INPUT") jump(sound.currentTime + step);
      if (event.code === "Home") jump(0);
    });
    resize();

    const show = () => {
      const time = Math.min(sound.currentTime, take.duration);
      if (clip) mixer.setTime(Math.min(time, clip.duration));
      if (sound instanceof Clock && sound.ended && !sound.paused) sound.pause();
      const resting = sound.paused || sound.ended;
      document.body.classList.toggle("playing", !resting);
      $("play").setAttribute("aria-label", resting ? "Play" : "Pause");
      if (document.activeElement !== seek || !resting) seek.value = time;
      $("time").textContent = `${clockText(time)} / ${clockText(take.duration)}`;
      draw();
      captions.show(time);
      controls.update();
      renderer.render(scene, camera);
    };
    renderer.setAnimationLoop(show);
    // What a script or a test may want to hold on to.
    window.elocute = { take, sound, meshes, show, jump };
    document.body.classList.add("ready");
  }, (error) => { $("title").textContent = `This take cannot be shown: ${error.message}`; });
}

start();
