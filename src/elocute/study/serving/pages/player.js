// Plays one video file on one canvas or two.
//
// A comparison is one file with both clips side by side over one sound. Each decoded picture is
// taken once, whole, and both canvases are drawn from it in one go, so that neither side can begin
// or run ahead of the other; the browser keeps that picture with its sound. `measured` tells how
// well it did.

const SETTLED = 3; // pictures after which a start has settled

/** Fetch a video whole, so that nothing waits for the network while it plays. */
export class Videos {
  constructor(get) {
    this.get = get;
    this.known = new Map();
  }

  /** A URL of the video's bytes; the same promise for the same video. */
  url(id) {
    if (!this.known.has(id)) {
      const made = this.get(`/media/${id}`).then((blob) => URL.createObjectURL(blob));
      made.catch(() => this.known.delete(id));
      this.known.set(id, made);
    }
    return this.known.get(id);
  }

  /** Forget all but these. */
  keep(ids) {
    for (const [id, made] of this.known) {
      if (ids.includes(id)) continue;
      this.known.delete(id);
      made.then((url) => URL.revokeObjectURL(url), () => {});
    }
  }
}

export class Player {
  /**
   * @param stage where it is put
   * @param clip as the server gives it: sides, swap, seconds
   * @param labels what is written under each canvas
   * @param share of the clip that must be seen
   * @param changed called whenever it starts, stops or was watched
   */
  constructor(stage, clip, labels, share, changed) {
    this.clip = clip;
    this.share = share;
    this.changed = changed;
    this.plays = 0;
    this.watched = share === 0;
    this.playing = false;
    this.pictures = [];
    this.video = document.createElement("video");
    this.video.playsInline = true;
    this.video.preload = "auto";
    this.video.disableRemotePlayback = true;
    this.video.tabIndex = -1;
    this.video.setAttribute("aria-hidden", "true");
    this.sides = document.createElement("div");
    this.sides.className = "sides";
    this.sides.dataset.sides = clip.sides;
    this.canvases = labels.map((label) => {
      const figure = document.createElement("figure");
      const canvas = document.createElement("canvas");
      canvas.setAttribute("role", "img");
      canvas.setAttribute("aria-label", label);
      const caption = document.createElement("figcaption");
      caption.textContent = label;
      figure.append(canvas, caption);
      this.sides.append(figure);
      return canvas;
    });
    // A video may show its next picture between two drawings of it.
    this.whole = document.createElement("canvas");
    stage.append(this.video, this.sides);
    this.video.addEventListener("ended", () => this.ended());
    this.video.addEventListener("timeupdate", () => this.look());
    this.hide = () => document.hidden && this.stop();
    document.addEventListener("visibilitychange", this.hide);
  }

  /** Load the video's bytes and show its first picture. */
  async load(url) {
    await new Promise((resolve, reject) => {
      this.video.addEventListener("loadeddata", resolve, { once: true });
      this.video.addEventListener("error", () => reject(new Error("cannot_play")), { once: true });
      this.video.src = url;
    });
    const wide = this.video.videoWidth / this.clip.sides;
    for (const canvas of this.canvases) {
      canvas.width = wide;
      canvas.height = this.video.videoHeight;
    }
    this.whole.width = this.video.videoWidth;
    this.whole.height = this.video.videoHeight;
    this.draw();
    this.follow();
  }

  /** Both sides from the picture that is there now. */
  draw() {
    this.whole.getContext("2d", { alpha: false }).drawImage(this.video, 0, 0);
    this.canvases.forEach((canvas, place) => {
      const half = this.clip.swap ? 1 - place : place;
      const context = canvas.getContext("2d", { alpha: false });
      const from = this.clip.sides === 1 ? 0 : half * canvas.width;
      context.drawImage(
        this.whole, from, 0, canvas.width, canvas.height, 0, 0, canvas.width, canvas.height,
      );
    });
  }

  follow() {
    if (this.gone) return;
    if (this.video.requestVideoFrameCallback) {
      this.video.requestVideoFrameCallback((now, shown) => {
        this.draw();
        this.note(now, shown);
        this.follow();
      });
    } else {
      requestAnimationFrame(() => {
        if (this.playing) this.draw();
        this.follow();
      });
    }
  }

  /** How late a picture is against the sound, which the element's clock follows. */
  note(now, shown) {
    if (!this.playing) return;
    const ahead = (shown.expectedDisplayTime - performance.now()) / 1000;
    const heard = this.video.currentTime + ahead;
    this.pictures.push({ at: shown.expectedDisplayTime, media: shown.mediaTime, heard });
  }

  /** The greatest distance of picture and sound in ms since the start settled, and lost pictures. */
  get measured() {
    const late = this.pictures
      .filter((each) => each.settled !== false)
      .map((each) => (each.heard - each.media) * 1000);
    const worst = late.reduce((a, b) => (Math.abs(b) > Math.abs(a) ? b : a), 0);
    const quality = this.video.getVideoPlaybackQuality?.();
    return { late_ms: Math.round(worst * 10) / 10, dropped: quality?.droppedVideoFrames ?? 0 };
  }

  /** Play from the beginning. */
  async play() {
    if (this.playing) return;
    this.playing = true;
    this.first = this.pictures.length;
    this.changed();
    try {
      this.video.currentTime = 0;
      await this.video.play();
      this.plays += 1;
    } catch (error) {
      if (this.gone) return;
      this.playing = false;
      this.failed = error.name !== "AbortError";
    }
    this.changed();
  }

  stop() {
    if (!this.playing) return;
    this.video.pause();
    this.playing = false;
    this.changed();
  }

  look() {
    const end = (Number.isFinite(this.video.duration) && this.video.duration) || this.clip.seconds;
    if (!this.playing || this.watched || this.video.currentTime < this.share * end - 0.05) return;
    this.watched = true;
    this.changed();
  }

  ended() {
    // A start takes a few pictures until the clock of the sound runs.
    this.pictures.slice(this.first, this.first + SETTLED).forEach((each) => {
      each.settled = false;
    });
    this.playing = false;
    this.watched = true;
    this.changed();
  }

  remove() {
    this.gone = true;
    document.removeEventListener("visibilitychange", this.hide);
    this.video.pause();
    this.video.removeAttribute("src");
    this.video.load();
  }
}
