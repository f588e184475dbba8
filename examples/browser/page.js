// A head that says what it hears: a sound that is dropped, or the microphone.
import { CameraMan } from "../../web/src/camera.js";
import { Pace } from "../../web/src/pace.js";
import { Stage } from "../../web/src/stage.js";

const SPEECH_RATE = 16000;
const BLOCK_S = 2; // of a file: the first frames are soon there
const LOOKAHEAD_S = 0.25, LATE_S = LOOKAHEAD_S + 0.08; // of the microphone; when its frames are shown
const WORKLET = `registerProcessor("pcm", class extends AudioWorkletProcessor {
  process([[samples]]) { if (samples) this.port.postMessage(samples.slice()); return true; }
});`;
const $ = (id) => document.getElementById(id);

function told(text) { $("state").textContent = text; }

// What was heard of a sound, and when it is shown.
class Take {
  constructor(number, time) {
    this.number = number;
    this.time = time; // () => seconds of the sound that are heard now
    this.frames = [];
    this.names = [];
    this.fps = 60;
    this.whole = false;
  }

  add({ names, fps, count, values }) {
    this.names = names;
    this.fps = fps;
    for (let at = 0; at < count; at++) this.frames.push(values.subarray(at * names.length, (at + 1) * names.length));
  }

  // Lay the frame that is due upon the head's shapes.
  show(influences, places) {
    influences.fill(0);
    if (!this.frames.length) return;
    const at = Math.max(0, Math.min(this.frames.length - 1, this.time() * this.fps));
    const here = this.frames[Math.floor(at)], next = this.frames[Math.ceil(at)], share = at % 1;
    this.names.forEach((name, curve) => { influences[places[name]] = here[curve] + share * (next[curve] - here[curve]); });
  }
}

class Page {
  constructor(context, worker) {
    this.context = context;
    this.worker = worker;
    this.take = new Take(0, () => 0);
    this.stop = this.begin = this.hearing = null;
    worker.onmessage = ({ data }) => this.heard(data);
  }

  heard({ take, frames, error, ready, end }) {
    if (error) told(error);
    if (ready) told("Drop a sound, or speak");
    if (take !== this.take.number) return;
    if (frames) this.take.add(frames);
    this.take.whole ||= Boolean(end);
    this.begin?.();
  }

  // Another sound takes the place of what is said now.
  async another(time, settings) {
    this.stop?.();
    this.stop = this.begin = null;
    await this.context.resume();
    this.take = new Take(this.take.number + 1, time);
    this.tell({ open: settings });
    return this.take;
  }

  tell(message, transfer = []) { this.worker.postMessage({ take: this.take.number, ...message }, transfer); }

  async file(file) {
    if (!file) return;
    const bytes = await file.arrayBuffer();
    // The browser itself resamples to what the network hears.
    const decoded = await new OfflineAudioContext(1, 1, SPEECH_RATE).decodeAudioData(bytes.slice(0)).catch(({ message }) => {
      throw new Error(`${file.name}: ${message}`);
    });
    const sound = await this.context.decodeAudioData(bytes);
    let start = Infinity;
    await this.another(() => this.context.currentTime - (this.context.outputLatency || 0) - start, { rate: SPEECH_RATE });
    told(`Listening to ${file.name}`);
    this.begin = () => {
      this.begin = null;
      start = this.play(sound, file.name);
    };
    const samples = mono(decoded), size = BLOCK_S * SPEECH_RATE;
    for (let at = 0; at < samples.length; at += size) this.tell({ samples: samples.slice(at, at + size) });
    this.tell({ end: true });
  }

  // The moment at which a sound begins.
  play(buffer, name) {
    const source = new AudioBufferSourceNode(this.context, { buffer }), start = this.context.currentTime + 0.1;
    source.connect(this.context.destination);
    source.onended = () => { if (this.stop === stop) told(name); };
    source.start(start);
    const stop = this.stop = () => source.stop();
    told(`${name}, ${buffer.duration.toFixed(1)} s`);
    return start;
  }

  async microphone() {
    const pressed = (on) => $("microphone").setAttribute("aria-pressed", String(on));
    if (this.hearing) return this.hearing();
    const stream = await navigator.mediaDevices.getUserMedia({ audio: true });
    const url = URL.createObjectURL(new Blob([WORKLET], { type: "text/javascript" }));
    await this.context.audioWorklet.addModule(url);
    const node = new AudioWorkletNode(this.context, "pcm", { numberOfOutputs: 0 });
    let start = Infinity;
    await this.another(() => this.context.currentTime - start - LATE_S, { rate: this.context.sampleRate, lookahead: LOOKAHEAD_S });
    node.port.onmessage = ({ data }) => {
      start = Math.min(start, this.context.currentTime);
      this.tell({ samples: data });
    };
    this.context.createMediaStreamSource(stream).connect(node);
    told("Listening");
    pressed(true);
    this.stop = this.hearing = () => {
      stream.getTracks().forEach((track) => track.stop());
      node.port.onmessage = this.hearing = this.stop = null;
      this.tell({ end: true });
      pressed(false);
      told("Drop a sound, or speak");
    };
    return undefined;
  }
}

// The mean of all channels.
function mono(buffer) {
  const samples = new Float32Array(buffer.length), count = buffer.numberOfChannels;
  for (let channel = 0; channel < count; channel++) {
    buffer.getChannelData(channel).forEach((value, at) => { samples[at] += value / count; });
  }
  return samples;
}

async function open() {
  const take = JSON.parse($("take").textContent);
  const stage = new Stage($("stage"), take.stage);
  const { head, renderer } = await stage.dress(take.fps);
  const camera = new CameraMan(renderer.domElement, take), pace = new Pace(renderer);
  camera.show("front");
  const worker = new Worker("worker.js", { type: "module" }), context = new AudioContext();
  const page = new Page(context, worker), influences = head.meshes[0].morphTargetInfluences;
  const places = head.meshes[0].morphTargetDictionary;
  const tried = (work) => async (event) => {
    event.preventDefault();
    try { await work(event); } catch (error) { told(`${error.message}`); }
  };
  const chosen = /** @type {HTMLInputElement} */ ($("file"));
  $("open").onclick = () => chosen.click();
  chosen.onchange = tried(() => page.file(chosen.files[0]));
  $("microphone").onclick = tried(() => page.microphone());
  addEventListener("dragover", (event) => event.preventDefault());
  addEventListener("drop", tried((event) => page.file(event.dataTransfer.files[0])));
  const show = () => {
    page.take.show(influences, places);
    head.move();
    stage.moved();
    camera.update();
    pace.tick(true);
    stage.draw(camera.camera);
  };
  new ResizeObserver(() => { stage.resize(camera); show(); }).observe($("stage"));
  stage.resize(camera);
  show();
  renderer.setAnimationLoop(show);
  window.elocute = { page, influences, places };
  document.body.classList.add("ready");
}

open();
