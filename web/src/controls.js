// Buttons, keys and what is told of the time.

import { save } from "./files.js";
import { Hints } from "./hints.js";

/** @type {(id: string) => any} */
const $ = (id) => document.getElementById(id);
export const VIEW_NAMES = { "front": "Front", "three-quarter": "Three-quarter", "side": "Side", "mouth": "Mouth" };

export function clockText(seconds) {
  const whole = Math.floor(seconds);
  return `${Math.floor(whole / 60)}:${String(whole % 60).padStart(2, "0")}.${Math.floor((seconds % 1) * 10)}`;
}

export class Controls {
  // page: take, sound, camera, canvas, jump(time), show(), head (bytes of the .glb), blob (sound),
  // curveTable() (text of a .csv).
  constructor(page) {
    this.page = page;
    this.looping = false;
    this.views = this.addViews();
    this.addPlayback();
    this.addToggles();
    this.addDownloads();
    this.hints = new Hints($("hint"));
    addEventListener("keydown", (event) => this.key(event));
  }

  addViews() {
    return Object.keys(this.page.take.views).map((name) => {
      const button = document.createElement("button");
      button.type = "button";
      button.textContent = VIEW_NAMES[name] ?? name;
      button.dataset.view = name;
      button.onclick = () => this.page.camera.show(name);
      $("views").append(button);
      return button;
    });
  }

  addPlayback() {
    const { take, sound, jump } = this.page;
    const seek = $("seek");
    seek.max = take.duration;
    $("play").onclick = () => this.toggle();
    seek.oninput = () => jump(Number(seek.value));
    $("whole").textContent = ` / ${clockText(take.duration)}`;
    $("volume").oninput = () => {
      sound.volume = Number($("volume").value);
      $("volume").style.setProperty("--at", sound.volume);
    };
    $("loud").hidden = !take.sound;
    $("speed").onchange = () => { sound.playbackRate = Number($("speed").value); };
    $("reset").onclick = () => {
      sound.pause();
      jump(0);
      this.page.camera.show("front");
    };
  }

  addToggles() {
    const root = document.documentElement;
    const press = (id, change, first) => {
      const set = (on) => { change(on); $(id).setAttribute("aria-pressed", String(on)); };
      $(id).onclick = () => set($(id).getAttribute("aria-pressed") !== "true");
      set(first);
    };
    press("loop", (on) => { this.looping = on; }, false);
    press("more", (on) => { document.body.classList.toggle("curves", on); }, false);
    press("caption", (on) => { $("captions").hidden = !on; }, true);
    $("caption").hidden = !this.page.take.words.length;
    $("theme").onclick = () => { root.dataset.theme = root.dataset.theme === "light" ? "dark" : "light"; };
    $("full").hidden = !document.fullscreenEnabled;
    $("full").onclick = () => (document.fullscreenElement ? document.exitFullscreen() : root.requestFullscreen());
    addEventListener("fullscreenchange", () => {
      $("full").setAttribute("aria-pressed", String(Boolean(document.fullscreenElement)));
    });
  }

  addDownloads() {
    const { take, blob, head, canvas, show, curveTable } = this.page;
    const name = document.title || "talk";
    $("downloads").hidden = window !== window.top; // a notebook's frame may not save files
    $("get-head").onclick = () => save(new Blob([head], { type: "model/gltf-binary" }), `${name}.glb`);
    $("get-sound").hidden = !blob;
    $("get-curves").onclick = () => save(new Blob([curveTable()], { type: "text/csv" }), `${name}.csv`);
    addEventListener("pointerdown", (event) => {
      for (const menu of document.querySelectorAll("details")) {
        if (!menu.contains(/** @type {Node} */ (event.target))) menu.open = false;
      }
    });
    const suffix = take.sound && take.sound.split("/").pop().replace("mpeg", "mp3").replace(/^x-/, "");
    $("get-sound").lastElementChild.textContent = `.${suffix}`;
    $("get-sound").onclick = () => save(blob, `${name}.${suffix}`);
    $("get-picture").onclick = () => {
      show();
      canvas.toBlob((picture) => save(picture, `${name}.png`), "image/png");
    };
  }

  toggle() {
    const { sound, jump } = this.page;
    if (!sound.paused && !sound.ended) { sound.pause(); return; }
    if (sound.ended) jump(0);
    sound.play();
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const { sound, camera, jump, take } = this.page;
    const field = /^(input|select)$/i.test(event.target.tagName);
    const button = /^(button|summary)$/i.test(event.target.tagName);
    const step = event.shiftKey ? 1 : 1 / take.fps;
    const { code } = event;
    if (code === "Space" && !button && !field) { event.preventDefault(); this.toggle(); }
    if (field) return;
    if (code === "ArrowLeft") jump(sound.currentTime - step);
    if (code === "ArrowRight") jump(sound.currentTime + step);
    if (code === "Home") jump(0);
    if (code === "End") jump(take.duration);
    camera.key(code);
    if (code === "Escape") document.querySelectorAll("details").forEach((menu) => { menu.open = false; });
    if (code === "KeyL") $("loop").click();
    if (code === "KeyF" && !$("full").hidden) $("full").click();
  }

  show(time) {
    const { sound, take, camera, jump } = this.page;
    if (this.looping && (sound.ended || time >= take.duration)) { jump(0); sound.play(); }
    const resting = sound.paused || sound.ended;
    document.body.classList.toggle("playing", !resting);
    $("play").setAttribute("aria-label", resting ? "Play" : "Pause");
    const seek = $("seek");
    if (document.activeElement !== seek || !resting) seek.value = time;
    seek.style.setProperty("--at", time / take.duration);
    const told = clockText(time);
    if ($("now").textContent !== told) {
      $("now").textContent = told;
      seek.setAttribute("aria-valuetext", $("time").textContent);
    }
    this.views.forEach((button) => {
      button.setAttribute("aria-pressed", String(button.dataset.view === camera.view));
    });
  }
}
