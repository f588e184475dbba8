// Fewer pixels at first and where a machine is slow; all of them once nothing moves.

const SLOW_MS = 60, LEAST = 0.5, STEP = 0.8, CALM_MS = 300;

export class Pace {
  constructor(renderer) {
    this.renderer = renderer;
    this.whole = Math.min(devicePixelRatio, 2);
    this.share = 1;
    this.since = 0;
    this.usual = 0;
    this.use(LEAST);
  }

  use(share) {
    this.share = share;
    this.renderer.setPixelRatio(this.whole * share);
  }

  // Called each time the screen is refreshed; moving: whether a new picture is wanted.
  // Whether a still picture should be drawn once more, sharply.
  tick(moving) {
    const now = performance.now();
    const took = now - this.last;
    this.last = now;
    if (!moving) {
      if (this.share === 1 || now - this.since < CALM_MS) return false;
      this.use(1);
      return true;
    }
    const lively = now - this.since < 1000;
    this.since = now;
    if (!lively) return false;
    this.usual = this.usual ? 0.7 * this.usual + 0.3 * took : took;
    if (this.usual > SLOW_MS && this.share > LEAST) {
      this.usual = 0;
      this.use(Math.max(LEAST, this.share * STEP));
    }
    return false;
  }
}
