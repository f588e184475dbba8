// A face that `elocute live` moves, over its WebSocket (docs/use/live-protocol.md).
const VERSION = 1;
const DELAY_S = 0.06; // by which frames without a sound of ours wait, so that a late one is in time
const LEAD_S = 0.12; // between a sound that is sent and its start, so that its frames are here
const FADE_S = 0.12;
const RETRY_MS = 1000;
const HEADER_BYTES = 16, FRAMES_MAX = 7200;
const WORKLET = `registerProcessor("pcm", class extends AudioWorkletProcessor {
  process([[samples]]) { if (samples) this.port.postMessage(samples.slice()); return true; }
});`;

const plain = (name) => name.split(".").pop().toLowerCase().replace(/_l$/, "left").replace(/_r$/, "right");

function pcm(samples) {
  if (samples instanceof Int16Array) return samples;
  return Int16Array.from(samples, (value) => Math.round(32767 * Math.max(-1, Math.min(1, value))));
}

export class LiveFace extends EventTarget {
  // url: ws://127.0.0.1:9872/live; shapes: "arkit", "vrm" or "elocute"; context: an AudioContext.
  constructor(url, { token = "", face = "main", shapes = "arkit", context = null } = {}) {
    super();
    Object.assign(this, { url, token, face, shapes, context, curves: [], joints: [], targets: [] });
    Object.assign(this, { values: new Float32Array(), turns: new Float32Array() });
    Object.assign(this, { frames: [], marks: [], sounds: [], sources: new Set() });
    this.open();
  }

  open() {
    this.socket = new WebSocket(this.url);
    this.socket.binaryType = "arraybuffer";
    this.socket.onopen = () => this.tell("hello", {
      version: VERSION, face: this.face, token: this.token, watch: { format: "binary", shapes: this.shapes },
    });
    this.socket.onmessage = ({ data }) => (data.at ? this.told(JSON.parse(data)) : this.shown(data));
    this.socket.onclose = () => {
      this.ready = false;
      this.emit("closed", {});
      if (!this.done) setTimeout(() => this.open(), RETRY_MS);
    };
  }

  close() {
    this.done = true;
    this.silence();
    this.socket.close();
  }

  tell(type, values = {}) { this.socket.send(JSON.stringify({ type, ...values })); }

  emit(type, detail) { this.dispatchEvent(new CustomEvent(type, { detail })); }

  told(message) {
    if (message.type === "welcome") {
      const { curves, joints } = message;
      const turns = Float32Array.from(joints.flatMap(() => [0, 0, 0, 1]));
      Object.assign(this, { curves, joints, values: new Float32Array(curves.length), turns });
      this.targets.forEach((target) => target.find(this));
      this.ready = true;
      this.waits = false;
      this.silence();
      this.restart();
    } else if (message.type === "started") {
      const sound = this.sounds.find((each) => each.time === undefined);
      if (!sound) this.restart();
      else this.play(sound, message.time_s);
      if (sound?.finished && !this.context) this.forget(sound);
    } else if (message.type === "interrupted") {
      this.waits = false;
      this.restart();
    }
    this.emit(message.type, message);
  }

  // Frames that follow belong to another time.
  restart() {
    if (this.sounds.some((sound) => sound.source)) return;
    this.frames = [];
    this.marks = [];
    this.fade();
  }

  fade() { this.fading = { values: this.values.slice(), turns: this.turns.slice(), since: this.now() }; }

  now() {
    const { context } = this;
    return context ? context.currentTime - (context.outputLatency || 0) : performance.now() / 1000;
  }

  shown(data) {
    if (this.waits) return;
    const view = new DataView(data), count = view.getUint32(4, true), time = view.getFloat64(8, true);
    const numbers = new Float32Array(data, HEADER_BYTES);
    const number = view.getUint32(0, true);
    const frame = { number, time, values: numbers.subarray(0, count), turns: numbers.subarray(count) };
    if (this.frames.length > FRAMES_MAX) this.frames.splice(0, FRAMES_MAX / 2); // the page is hidden
    this.frames.push(frame);
    const now = this.now(), late = this.time(now) - time, mark = this.marks.at(-1);
    if (!mark) this.marks.push({ at: now + DELAY_S, time });
    else if (late > 0 && !(mark.own && this.sounds.length)) mark.at += late + DELAY_S / 4;
    this.emit("frame", frame);
  }

  // The time of the frame that is to be seen.
  time(now = this.now()) {
    while (this.marks.length > 1 && this.marks[1].at <= now) {
      const [{ at, time }, next] = this.marks;
      if (Math.abs(time + next.at - at - next.time) > 0.02) this.fade();
      this.marks.shift();
    }
    const [mark] = this.marks;
    return mark ? mark.time + now - mark.at : -Infinity;
  }

  // Move all that is attached, and give the time of what is shown; call it before each picture.
  update() {
    const now = this.now(), time = this.time(now), { frames } = this;
    while (frames.length > 1 && frames[1].time <= time) frames.shift();
    const [here, next = here] = frames;
    const shown = here && Math.max(here.time, Math.min(next.time, time));
    if (here) this.blend(here, next, next === here ? 0 : (shown - here.time) / (next.time - here.time));
    if (this.fading) this.lead(now);
    this.targets.forEach((target) => target.move(this));
    return shown;
  }

  blend(here, next, share) {
    for (const kind of ["values", "turns"]) {
      const [to, from, more] = [this[kind], here[kind], next[kind]];
      for (let at = 0; at < to.length; at++) to[at] = from[at] + share * (more[at] - from[at]);
    }
  }

  lead(now) {
    const { since, values } = this.fading, share = (now - since) / FADE_S;
    if (share >= 1 || values.length !== this.values.length) this.fading = null;
    else this.blend(this.fading, { values: this.values, turns: this.turns }, share);
  }

  // Whatever has morph targets below a three.js object, or a VRM; joints: { head: object, … }.
  attach(object, joints = {}) {
    const target = new Target(object, joints);
    target.find(this);
    this.targets.push(target);
    return () => { this.targets = this.targets.filter((each) => each !== target); };
  }

  // Say something: blocks of floats or 16-bit integers, heard through the context, and seen.
  speak(samples, rate) {
    this.begin(rate);
    this.write(samples);
    this.finish();
  }

  begin(rate) {
    this.sound = { rate, blocks: [], written: 0 };
    this.sounds.push(this.sound);
    this.tell("start", { rate, channels: 1 });
  }

  write(samples) {
    const block = pcm(samples), { sound } = this;
    this.socket.send(block);
    sound.blocks.push(block);
    if (sound.time !== undefined) this.play(sound, sound.time);
  }

  finish() {
    const { sound } = this;
    sound.finished = true;
    this.tell("end");
    if (!this.context && sound.time !== undefined) this.forget(sound);
  }

  // The blocks that were not heard yet, each after the one before.
  play(sound, time) {
    const { context } = this;
    if (sound.time === undefined && !this.sounds.some((each) => each.source)) {
      this.frames = this.frames.filter((frame) => frame.time >= time);
      this.fade();
    }
    sound.time = time;
    for (const block of sound.blocks.splice(0)) {
      const at = Math.max((context?.currentTime ?? this.now()) + LEAD_S, this.until ?? 0);
      this.marks.push({ at, time: time + sound.written / sound.rate, own: true });
      sound.written += block.length;
      this.until = at + block.length / sound.rate;
      if (context) sound.source = this.heard(block, sound, at);
    }
  }

  heard(block, sound, at) {
    const buffer = this.context.createBuffer(1, block.length, sound.rate);
    buffer.copyToChannel(Float32Array.from(block, (value) => value / 32768), 0);
    const source = this.context.createBufferSource();
    source.buffer = buffer;
    source.connect(this.context.destination);
    source.onended = () => {
      this.sources.delete(source);
      if (sound.source !== source || !sound.finished) return;
      this.forget(sound);
    };
    source.start(at);
    this.sources.add(source);
    return source;
  }

  forget(sound) {
    this.sounds = this.sounds.filter((each) => each !== sound);
    this.emit("spoken", {});
  }

  silence() {
    this.sources.forEach((source) => { source.onended = null; source.stop(); });
    Object.assign(this, { sounds: [], sources: new Set(), until: 0 });
  }

  // Stop at once.
  interrupt() {
    this.silence();
    this.waits = true;
    this.tell("interrupt");
  }

  // The sound that follows is a partner's.
  listen(on) { this.tell("listen", { on }); }

  // Hear the microphone; the promise gives what ends it.
  async microphone(constraints = true) {
    const { context } = this;
    const stream = await navigator.mediaDevices.getUserMedia({ audio: constraints });
    const url = URL.createObjectURL(new Blob([WORKLET], { type: "text/javascript" }));
    await context.audioWorklet.addModule(url);
    URL.revokeObjectURL(url);
    const worklet = new AudioWorkletNode(context, "pcm", { numberOfOutputs: 0 });
    this.tell("start", { rate: context.sampleRate, channels: 1 });
    worklet.port.onmessage = ({ data }) => this.socket.readyState === 1 && this.socket.send(pcm(data));
    context.createMediaStreamSource(stream).connect(worklet);
    return () => {
      stream.getTracks().forEach((track) => track.stop());
      worklet.port.onmessage = null;
      this.tell("end");
    };
  }
}

class Target {
  constructor(object, joints) { Object.assign(this, { object, joints, meshes: [], turned: [] }); }

  find({ curves, joints }) {
    const places = new Map(curves.map((name, at) => [plain(name), at]));
    this.meshes = [];
    const look = ({ morphTargetDictionary, morphTargetInfluences }) => {
      const pairs = Object.entries(morphTargetDictionary ?? {})
        .map(([name, to]) => [to, places.get(plain(name))]).filter(([, from]) => from !== undefined);
      if (pairs.length) this.meshes.push([morphTargetInfluences, pairs]);
    };
    const { expressionManager, traverse } = this.object;
    if (expressionManager) this.names = curves.map((name, at) => [name, at]).filter(([name]) => expressionManager.getExpression(name));
    else if (traverse) this.object.traverse(look);
    else look(this.object);
    this.turned = joints.map((name, at) => [this.joints[name], 4 * at]).filter(([object]) => object);
  }

  move({ values, turns }) {
    this.names?.forEach(([name, at]) => this.object.expressionManager.setValue(name, values[at]));
    for (const [influences, pairs] of this.meshes) for (const [to, from] of pairs) influences[to] = values[from];
    for (const [object, at] of this.turned) object.quaternion.fromArray(turns, at).normalize();
  }
}
