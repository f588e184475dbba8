// What keeps the time: the sound, or a clock where there is none.

export class Clock {
  constructor(duration) {
    this.duration = duration; this.at = 0; this.since = 0; this.paused = true; this.rate = 1;
  }
  get currentTime() {
    if (this.paused) return this.at;
    return Math.min(this.duration, this.at + ((performance.now() - this.since) / 1000) * this.rate);
  }
  set currentTime(value) { this.at = value; this.since = performance.now(); }
  get playbackRate() { return this.rate; }
  // What has passed went by at the old rate.
  // eslint-disable-next-line no-self-assign
  set playbackRate(value) { this.currentTime = this.currentTime; this.rate = value; }
  get ended() { return this.currentTime >= this.duration; }
  play() { if (this.ended) this.at = 0; this.since = performance.now(); this.paused = false; }
  pause() { this.at = this.currentTime; this.paused = true; }
}

// source: the sound's bytes or its address, or nothing.
export function soundOf(source, duration) {
  if (!source) return new Clock(duration);
  const audio = new Audio();
  audio.src = source instanceof Blob ? URL.createObjectURL(source) : source;
  audio.preload = "auto";
  return audio;
}
