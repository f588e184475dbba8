// Where the camera stands: the views of the pictures, and the user's own orbit, which stays.
import * as THREE from "three";
import { OrbitControls } from "three/examples/jsm/controls/OrbitControls.js";

const STEP = THREE.MathUtils.degToRad(5);
const TURNS = { KeyA: [-1, 0], KeyD: [1, 0], KeyW: [0, 1], KeyS: [0, -1] };
const NEARER = { Equal: 0.92, NumpadAdd: 0.92, Minus: 1 / 0.92, NumpadSubtract: 1 / 0.92 };
const VIEW_KEYS = ["Digit1", "Digit2", "Digit3", "Digit4"];
const NARROW = 0.8; // a picture less wide than this share of its height shows less at the sides

export class CameraMan {
  constructor(canvas, take) {
    this.views = take.views;
    this.camera = new THREE.PerspectiveCamera(take.field_deg, 1, 0.05, 10);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.enableDamping = true;
    this.controls.minDistance = 0.15;
    this.controls.maxDistance = 4;
    // Until the user turns the head, a new shape of the window frames it anew.
    this.view = null;
    this.controls.addEventListener("start", () => { this.view = null; });
  }

  show(name) {
    const { position, target } = this.views[name];
    this.view = name;
    this.controls.target.fromArray(target);
    this.camera.position.fromArray(position);
    const away = this.camera.position.sub(this.controls.target);
    away.multiplyScalar(Math.max(1, NARROW / this.camera.aspect)).add(this.controls.target);
    this.settle();
  }

  resize(width, height) {
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    if (this.view) this.show(this.view);
  }

  // Turn by steps of five degrees; closer: above 1 is further away.
  orbit(right, up, closer = 1) {
    this.view = null;
    const away = this.camera.position.clone().sub(this.controls.target);
    const place = new THREE.Spherical().setFromVector3(away);
    place.theta += right * STEP;
    place.phi = THREE.MathUtils.clamp(place.phi - up * STEP, 0.05, Math.PI - 0.05);
    const { minDistance, maxDistance } = this.controls;
    place.radius = THREE.MathUtils.clamp(place.radius * closer, minDistance, maxDistance);
    this.camera.position.setFromSpherical(place).add(this.controls.target);
    this.settle();
  }

  // What a key does; whether it does anything.
  key(code) {
    const view = Object.keys(this.views)[VIEW_KEYS.indexOf(code)];
    if (code in TURNS) this.orbit(...TURNS[code]);
    else if (code in NEARER) this.orbit(0, 0, NEARER[code]);
    else if (view) this.show(view);
    else return false;
    return true;
  }

  // What is left of a swing would carry the camera on.
  settle() {
    this.controls.enableDamping = false;
    this.controls.update();
    this.controls.enableDamping = true;
    this.moved = true;
  }

  // Whether it stands elsewhere than before.
  update() {
    const moved = this.controls.update() || this.moved;
    this.moved = false;
    return moved;
  }
}
