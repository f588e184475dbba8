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
  set playbackRate(value) { this.currentTime = this.currentTime; this.rate = value; }
  get ended() { return this.currentTime >= this.duration; }
  play() { if (this.ended) this.at = 0; this.since = performance.now(); this.paused = false; }
  pause() { this.at = this.currentTime; this.paused = true; }
}

export function soundOf(blob, duration) {
  if (!blob) return new Clock(duration);
  const audio = new Audio();
  audio.src = URL.createObjectURL(blob);
  audio.preload = "auto";
  return audio;
}
