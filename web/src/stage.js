// The head of a page in its light, on a canvas.
import * as THREE from "three";
import { bytesOf, unpacked } from "./files.js";
import { foldsOf } from "./folds.js";
import { Head } from "./head.js";
import { mouthOf } from "./mouth.js";
import { Shading, Shadow } from "./shading.js";

// A colour of three numbers to 255, by its luma: the controls go with the picture above them.
const bright = ([red, green, blue]) => 0.3 * red + 0.59 * green + 0.11 * blue > 128;

// What lies behind the head, as `ground` of the pictures' GLSL has it.
function spot([middle, margin]) {
  const stops = Array.from({ length: 9 }, (_, step) => {
    const away = step / 8, share = away * away * (3 - 2 * away);
    return `rgb(${middle.map((from, index) => (from + share * (margin[index] - from)).toFixed(1)).join(" ")})`;
  });
  return `radial-gradient(100% 87% at 50% 38%, ${stops})`;
}

export class Stage {
  // room: the element that holds the canvas; look: what `viewer_stage` of html.py tells, or null
  // where heads come later.
  constructor(room, look) {
    this.room = room;
    this.renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true, preserveDrawingBuffer: true });
    const canvas = this.renderer.domElement;
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", "A speaking head. Drag, or use A, D, W and S, to turn it.");
    room.append(canvas);
    if (!look) return;
    this.light(look);
    document.documentElement.dataset.theme = bright(look.ground[1]) ? "light" : "dark";
  }

  // What lies behind a head in its light.
  light(look) {
    const { room } = this;
    this.look = look;
    room.style.setProperty("--ground", spot(look.ground));
    if (look.light_ground) room.style.setProperty("--light-ground", spot(look.light_ground));
  }

  // The page's head, its materials and folds.
  async dress(fps) {
    return this.wear(await this.made(this.look, await unpacked(bytesOf("head")), fps));
  }

  // A head in the light of a look, to be worn.
  async made(look, bytes, fps) {
    const shading = new Shading(look);
    const head = new Head(bytes, fps);
    const { meshes } = head;
    const pictures = await head.pictures();
    const folds = foldsOf(meshes, look.folds, pictures);
    const mouth = mouthOf(meshes, look.mouth);
    meshes.forEach((mesh) => shading.dress(mesh, pictures, folds, mouth));
    const shadow = Shadow.possible(this.renderer) && new Shadow(shading, look.shadow_side);
    return { head, meshes, folds, mouth, shadow };
  }

  wear({ head, meshes, folds, mouth, shadow }) {
    this.head = head;
    this.meshes = meshes;
    this.folds = folds;
    this.mouth = mouth;
    this.shadow = shadow;
    return this;
  }

  // Free what a head holds in the graphics' memory.
  drop({ meshes, shadow }) {
    meshes.forEach(({ geometry, material }) => {
      geometry.dispose();
      Object.values(material.uniforms).forEach(({ value }) => { if (value?.isTexture) value.dispose(); });
      material.dispose();
    });
    if (shadow) [shadow.raw, shadow.between, shadow.moments].forEach((target) => target.dispose());
  }

  // What follows from a pose of the head.
  moved() {
    this.folds?.update();
    this.mouth.update();
    if (this.shadow) this.shadow.draw(this.renderer, this.head.scene, this.meshes);
  }

  draw(camera) { this.renderer.render(this.head.scene, camera); }

  // Whether there is anything to be drawn on.
  resize(camera) {
    const { clientWidth: width, clientHeight: height } = this.room;
    if (!width || !height) return false;
    this.renderer.setSize(width, height);
    camera.resize(width, height);
    return true;
  }

  // Once all that was asked of the graphics is done.
  async drawn() {
    const gl = /** @type {WebGL2RenderingContext} */ (this.renderer.getContext());
    const done = gl.fenceSync(gl.SYNC_GPU_COMMANDS_COMPLETE, 0);
    gl.flush();
    while (gl.clientWaitSync(done, 0, 0) === gl.TIMEOUT_EXPIRED) {
      await new Promise((next) => { setTimeout(next, 4); });
    }
    gl.deleteSync(done);
  }
}
