// The head of the take that is shown, in time with its sound.
import { signal } from "@preact/signals";
import { CameraMan } from "../camera.js";
import { Frames } from "../head.js";
import { Pace } from "../pace.js";
import { soundOf } from "../sound.js";
import { Stage } from "../stage.js";
import { type HeadRecord, server, type TakeRecord } from "./server";

export interface Take extends TakeRecord {
  light: string;
  weights: Float32Array; // (frame, shape) of the curves
  moves: Float32Array; // (frame, shape) of the head that is seen: a character has shapes of its own
  turns: Float32Array; // (frame, joint, 4)
}

const HEADS_KEPT = 3;

export const now = signal(0); // s
export const playing = signal(false);
export const looping = signal(false);
export const range = signal<[number, number] | null>(null);
export const view = signal("front");

interface Worn { record: HeadRecord; made: Awaited<ReturnType<Stage["made"]>> }

export class Player {
  stage: Stage;
  camera: CameraMan | null = null;
  pace: Pace;
  sound = soundOf(null, 0);
  source = "";
  duration = 0;
  take: Take | null = null;
  asked: Take | null = null;
  heads = new Map<string, Promise<Worn>>();
  posed: number | null = null;
  stale = true;

  constructor(room: HTMLElement) {
    this.stage = new Stage(room, null);
    this.pace = new Pace(this.stage.renderer);
    new ResizeObserver(() => this.resize()).observe(room);
    this.stage.renderer.setAnimationLoop(() => this.show());
  }

  // The sound's address; it stays where it is the same.
  hear(source: string, duration: number) {
    this.duration = duration;
    if (this.source === source) return;
    const { playbackRate } = this.sound;
    this.sound.pause();
    this.source = source;
    this.sound = soundOf(source, duration);
    this.sound.playbackRate = playbackRate;
    this.posed = null;
  }

  silence() {
    this.sound.pause();
    this.sound = soundOf(null, 0);
    this.source = "";
    this.take = null;
  }

  head({ head_key, head_url, light, fps }: Take): Promise<Worn> {
    const key = `${head_key} ${light}`, known = this.heads.get(key);
    const worn = known ?? Promise.all([server.stage(head_key, light), server.bytes(head_url)])
      .then(async ([record, bytes]) => ({ record, made: await this.stage.made(record.stage, bytes, fps) }));
    worn.catch(() => this.heads.delete(key));
    // The latest are kept: two of them are compared, and undoing goes back and forth.
    this.heads.delete(key);
    this.heads.set(key, worn);
    for (const old of [...this.heads.keys()].slice(0, -HEADS_KEPT)) {
      this.heads.get(old)?.then(({ made }) => this.stage.drop(made));
      this.heads.delete(old);
    }
    return worn;
  }

  // Show a take, where the time stands.
  async wear(take: Take) {
    this.asked = take;
    const { record, made } = await this.head(take);
    if (this.asked !== take) return; // another was asked for meanwhile
    const { head } = made;
    const at = head.glb.json.skins?.[0].joints ?? [];
    const turns = at.map((node: number, joint: number) => [node, take.turns, 4 * joint, 4 * at.length]);
    head.frames = new Frames(take.fps, take.frames, take.moves, take.turns.length ? turns : []);
    this.take = take;
    if (this.stage.head !== head) {
      this.stage.wear(made);
      this.stage.light(record.stage);
      this.frame(record);
    }
    this.posed = null;
    this.show();
  }

  frame(record: HeadRecord) {
    if (!this.camera) {
      this.camera = new CameraMan(this.stage.renderer.domElement, record);
      this.camera.show("front");
    }
    this.camera.views = record.views;
    this.resize();
  }

  resize() {
    if (this.camera && this.stage.resize(this.camera)) { this.stale = true; this.show(); }
  }

  jump(time: number) {
    this.sound.currentTime = Math.max(0, Math.min(this.duration, time));
    now.value = this.sound.currentTime;
  }

  step(frames: number) {
    const { fps } = this.take ?? { fps: 60 };
    this.sound.pause();
    this.jump((Math.round(this.sound.currentTime * fps) + frames) / fps);
  }

  toggle() {
    const { sound } = this;
    if (!sound.paused && !sound.ended) { sound.pause(); return; }
    const [start, end] = this.bounds();
    if (sound.ended || sound.currentTime >= end - 0.01 || sound.currentTime < start) this.jump(start);
    sound.play();
  }

  bounds(): [number, number] {
    return looping.value && range.value ? range.value : [0, this.duration];
  }

  // A picture is drawn where it would differ from the one that is there.
  show() {
    const { stage, camera, take } = this;
    if (!take || !camera) return;
    this.turn();
    const time = Math.min(this.sound.currentTime, this.duration);
    playing.value = !this.sound.paused && !this.sound.ended;
    now.value = time;
    view.value = camera.view ?? "";
    if (time !== this.posed) {
      stage.head.pose(time);
      stage.moved();
      this.posed = time;
      this.stale = true;
    }
    if (camera.update()) this.stale = true;
    if (this.pace.tick(this.stale)) this.stale = true;
    if (this.stale) stage.draw(camera.camera);
    this.stale = false;
  }

  // At the end of what is looped, back to its start.
  turn() {
    const { sound } = this;
    if (!looping.value || (sound.paused && !sound.ended)) return;
    const [start, end] = this.bounds();
    if (sound.ended || sound.currentTime >= end || sound.currentTime < start - 0.05) {
      this.jump(start);
      if (sound.paused || sound.ended) sound.play();
    }
  }
}
