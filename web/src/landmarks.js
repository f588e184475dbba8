// A page to set landmarks on a mesh: the mesh, what is asked for, and a file to save.
// The page carries everything; nothing is fetched.
import * as THREE from "three";
import { TrackballControls } from "three/examples/jsm/controls/TrackballControls.js";
import { bytesOf, save, unpacked } from "./files.js";
import { expected, portrait } from "./placement.js";

/** @type {(id: string) => any} */
const $ = (id) => document.getElementById(id);
const FIELD_DEG = 25;
const CLICK_PIXELS = 4; // a pointer that moves further has turned the view
const DOT = 0.012, RING = 0.022; // shares of the mesh's radius, or of the face's height
const PORTRAIT = 0.75; // heights of the face in half a picture's height
const SET = 0xf0904c, CURRENT = 0xe5484d;

class Page {
  constructor(take, points, triangles, colors) {
    this.take = take;
    this.average = take.average.map((point) => new THREE.Vector3(...point));
    this.set = new Map(); // landmark to place, in the file's frame
    this.saved = true;
    this.mesh = meshOf(points, triangles, colors);
    this.scene();
    this.map();
    this.keys();
    this.ask(take.order[0]);
  }

  scene() {
    const sphere = this.mesh.geometry.boundingSphere;
    this.radius = this.unit = sphere.radius;
    // The mesh turns about its middle, and what is set on it turns with it.
    this.turned = new THREE.Group();
    this.inner = new THREE.Group();
    this.inner.position.copy(sphere.center).negate();
    this.turned.add(this.inner);
    this.inner.add(this.mesh);
    this.world = new THREE.Scene();
    this.world.add(this.turned);
    this.renderer = new THREE.WebGLRenderer({ antialias: true, alpha: true, preserveDrawingBuffer: true });
    const canvas = this.renderer.domElement;
    canvas.tabIndex = 0;
    canvas.setAttribute("role", "img");
    canvas.setAttribute("aria-label", "The mesh. Drag to turn it, click to set a landmark.");
    $("stage").append(canvas);
    this.camera = new THREE.PerspectiveCamera(FIELD_DEG, 1, this.radius / 50, this.radius * 20);
    const key = new THREE.DirectionalLight(0xffffff, 1.9);
    key.position.set(-0.5, 0.8, 0.6);
    this.camera.add(key, new THREE.AmbientLight(0xffffff, 1.1));
    this.world.add(this.camera);
    this.controls = new TrackballControls(this.camera, canvas);
    this.controls.rotateSpeed = 2.5;
    this.controls.staticMoving = true;
    this.dots = new THREE.Group();
    this.inner.add(this.dots);
    this.ring = new THREE.Mesh(
      new THREE.TorusGeometry(1, 0.16, 8, 32),
      new THREE.MeshBasicMaterial({ color: CURRENT, depthTest: false, transparent: true }),
    );
    this.ring.renderOrder = 1;
    this.inner.add(this.ring);
    this.front();
    new ResizeObserver(() => this.resize()).observe($("stage"));
    this.resize();
    this.controls.addEventListener("change", () => this.draw());
    this.renderer.setAnimationLoop(() => this.controls.update());
  }

  front() {
    this.controls.reset();
    this.turned.rotation.set(0, 0, 0);
    this.camera.up.set(0, 1, 0);
    this.camera.position.set(0, 0, 1.15 * this.radius / Math.sin(THREE.MathUtils.degToRad(FIELD_DEG) / 2));
    this.controls.target.set(0, 0, 0);
    this.controls.update();
    this.draw();
  }

  // The face that the landmarks tell of, upright and near.
  face() {
    const view = portrait(this.average, this.set);
    if (!view) return;
    this.inner.updateWorldMatrix(true, false);
    const turn = this.turned.quaternion;
    this.unit = Math.min(this.radius, view.height);
    this.mark();
    const away = PORTRAIT * view.height / Math.tan(THREE.MathUtils.degToRad(FIELD_DEG) / 2);
    this.controls.target.copy(this.inner.localToWorld(view.middle));
    this.camera.up.copy(view.up).applyQuaternion(turn);
    this.camera.position.copy(view.toward).applyQuaternion(turn).multiplyScalar(away).add(this.controls.target);
    this.controls.update();
    this.draw();
  }

  resize() {
    const { clientWidth: width, clientHeight: height } = $("stage");
    if (!width || !height) return;
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.controls.handleResize();
    this.draw();
  }

  draw() {
    this.ring.quaternion.copy(this.turned.quaternion).invert().multiply(this.camera.quaternion);
    this.renderer.render(this.world, this.camera);
  }

  // Dots on a drawn face: what is set, what is asked for, what may be asked for.
  map() {
    const { drawing, lines, names, order } = this.take;
    const wanted = new Set(order);
    $("map").querySelector("svg").innerHTML = lines
      .map((line) => `<path d="M${line.map((index) => drawing[index].join(" ")).join("L")}"/>`).join("");
    this.buttons = drawing.map(([x, y], index) => {
      const button = document.createElement("button");
      button.type = "button";
      button.style.left = `${x}%`;
      button.style.top = `${y / 1.02}%`;
      button.title = names[index];
      button.classList.toggle("wanted", wanted.has(index));
      button.onclick = () => this.ask(index);
      $("map").append(button);
      return button;
    });
  }

  keys() {
    const canvas = this.renderer.domElement;
    let down = null;
    canvas.addEventListener("pointerdown", (event) => { down = event.button === 0 ? [event.clientX, event.clientY] : null; });
    canvas.addEventListener("pointerup", (event) => {
      const still = down && Math.hypot(event.clientX - down[0], event.clientY - down[1]) < CLICK_PIXELS;
      const place = still && this.hit(event);
      if (place) this.put(place);
    });
    $("take-it").onclick = () => this.put(this.suggested);
    $("skip").onclick = () => this.ask(this.next());
    $("clear").onclick = () => this.clear();
    $("save").onclick = () => this.save();
    $("open").onclick = () => $("file").click();
    $("file").onchange = () => this.open();
    $("roll").onclick = () => this.turn(new THREE.Vector3(0, 0, 1));
    $("tip").onclick = () => this.turn(new THREE.Vector3(1, 0, 0));
    $("reset").onclick = () => this.front();
    $("face").onclick = () => this.face();
    $("colours").onclick = () => this.colour($("colours").getAttribute("aria-pressed") !== "true");
    addEventListener("keydown", (event) => {
      const button = /** @type {Element} */ (event.target).tagName === "BUTTON";
      if (event.ctrlKey || event.metaKey || event.altKey) return;
      if (event.code === "Enter" && !button) $("take-it").click();
      if (event.code === "Backspace") this.clear();
      if (event.code === "ArrowRight") this.ask(this.beside(1));
      if (event.code === "ArrowLeft") this.ask(this.beside(-1));
    });
    addEventListener("beforeunload", (event) => { if (!this.saved) event.preventDefault(); });
  }

  colour(on) {
    $("colours").setAttribute("aria-pressed", String(on));
    this.mesh.material.vertexColors = on;
    this.mesh.material.needsUpdate = true;
    this.draw();
  }

  turn(axis) {
    this.turned.quaternion.premultiply(new THREE.Quaternion().setFromAxisAngle(axis, Math.PI / 2));
    this.draw();
  }

  // Where a pointer meets the mesh, in the file's frame.
  hit(event) {
    const box = this.renderer.domElement.getBoundingClientRect();
    const place = new THREE.Vector2(
      2 * (event.clientX - box.left) / box.width - 1, 1 - 2 * (event.clientY - box.top) / box.height,
    );
    const ray = new THREE.Raycaster();
    this.world.updateMatrixWorld(true);
    ray.setFromCamera(place, this.camera);
    const [found] = ray.intersectObject(this.mesh);
    return found ? this.mesh.worldToLocal(found.point.clone()) : null;
  }

  put(place) {
    if (!place) return;
    this.set.set(this.current, place.clone());
    this.saved = false;
    this.ask(this.next());
    if (this.suggested && !this.faced) this.face();
    this.faced ||= Boolean(this.suggested);
    $("face").disabled = !this.faced;
  }

  clear() {
    if (!this.set.delete(this.current)) return;
    this.saved = false;
    this.ask(this.current);
  }

  // The landmark after this one that is asked for and not set; where all are, the next of all 68.
  next() {
    const { order } = this.take;
    const waiting = (list) => list.filter((index) => !this.set.has(index) && index !== this.current);
    const at = order.indexOf(this.current);
    const [first] = waiting([...order.slice(at + 1), ...order.slice(0, Math.max(at, 0))]);
    const others = [...this.average.keys()];
    return first ?? waiting([...others.slice(this.current + 1), ...others])[0] ?? this.current;
  }

  beside(step) {
    const list = this.take.order.includes(this.current) ? this.take.order : [...this.average.keys()];
    return list[(list.indexOf(this.current) + step + list.length) % list.length];
  }

  ask(index) {
    this.current = index;
    const { names, order, enough } = this.take;
    const count = this.set.size, left = order.filter((each) => !this.set.has(each)).length;
    const [name, where] = names[index].split("; ");
    $("asked").querySelector("b").textContent = name[0].toUpperCase() + name.slice(1);
    $("asked").querySelector("span").textContent = where ?? "";
    this.suggested = this.set.has(index) ? null : this.nearest(expected(index, this.average, this.set));
    $("take-it").disabled = !this.suggested;
    $("clear").disabled = !this.set.has(index);
    $("save").disabled = count < enough;
    $("count").textContent = count < enough
      ? `${count} set; ${enough} are needed, ${order.length} are asked for`
      : left ? `${count} set, enough to save; ${left} more are asked for` : `${count} set; all that is asked for is there`;
    this.buttons.forEach((button, each) => {
      button.classList.toggle("set", this.set.has(each));
      button.setAttribute("aria-current", String(each === index));
      button.setAttribute("aria-label", names[each] + (this.set.has(each) ? ", set" : ""));
    });
    this.mark();
  }

  mark() {
    this.dots.clear();
    for (const [index, place] of this.set) {
      const dot = new THREE.Mesh(
        new THREE.SphereGeometry(this.unit * DOT, 12, 8),
        new THREE.MeshBasicMaterial({ color: index === this.current ? CURRENT : SET }),
      );
      dot.position.copy(place);
      this.dots.add(dot);
    }
    this.ring.visible = Boolean(this.suggested);
    this.ring.scale.setScalar(this.unit * RING);
    if (this.suggested) this.ring.position.copy(this.suggested);
    this.draw();
  }

  // The mesh's vertex nearest to a place.
  nearest(place) {
    if (!place) return null;
    const { array } = this.mesh.geometry.attributes.position;
    let best = 0, least = Infinity;
    for (let at = 0; at < array.length; at += 3) {
      const away = (array[at] - place.x) ** 2 + (array[at + 1] - place.y) ** 2 + (array[at + 2] - place.z) ** 2;
      if (away < least) { least = away; best = at; }
    }
    return new THREE.Vector3().fromArray(array, best);
  }

  record() {
    const places = this.average.map((_, index) => this.set.get(index));
    const points = places.map((place) => place && place.toArray().map((value) => Number(value.toPrecision(9))));
    return { points: points.map((point) => point ?? null), confidence: places.map((place) => Number(Boolean(place))) };
  }

  save() {
    save(new Blob([JSON.stringify(this.record()) + "\n"], { type: "application/json" }), this.take.file);
    this.saved = true;
  }

  async open() {
    const [file] = $("file").files;
    $("file").value = "";
    try {
      const { points } = JSON.parse(await file.text());
      if (points.length !== this.average.length) throw new Error(`${points.length} points`);
      const places = points.map((point) => (point ? new THREE.Vector3(...point) : null));
      if (places.some((place) => place && !place.toArray().every(Number.isFinite))) throw new Error("no numbers");
      this.set = new Map(places.map((place, index) => [index, place]).filter(([, place]) => place));
      this.ask(this.next());
      this.face();
      this.faced = this.set.size > 3;
      $("face").disabled = !this.faced;
    } catch (error) {
      $("count").textContent = `${file.name} holds no landmarks (${error.message})`;
    }
  }
}

function meshOf(points, triangles, colors) {
  const geometry = new THREE.BufferGeometry();
  geometry.setAttribute("position", new THREE.BufferAttribute(points, 3));
  geometry.setAttribute("color", new THREE.BufferAttribute(linear(colors), 3));
  geometry.setIndex(new THREE.BufferAttribute(triangles, 1));
  geometry.computeVertexNormals();
  geometry.computeBoundingSphere();
  const material = new THREE.MeshStandardMaterial({ vertexColors: true, roughness: 0.75, side: THREE.DoubleSide });
  return new THREE.Mesh(geometry, material);
}

// Colours of vertices are linear light to three.js; a mesh's are sRGB.
function linear(colors) {
  const of = (value) => new THREE.Color().setRGB(value / 255, 0, 0, THREE.SRGBColorSpace).r;
  const table = Float32Array.from({ length: 256 }, (_, value) => of(value));
  return Float32Array.from(colors, (value) => table[value]);
}

async function start() {
  const bytes = async (id) => (await unpacked(bytesOf(id))).buffer;
  const [points, triangles, colors] = await Promise.all(["points", "triangles", "colors"].map(bytes));
  const take = JSON.parse($("take").textContent);
  const page = new Page(take, new Float32Array(points), new Uint32Array(triangles), new Uint8Array(colors));
  // What a script or a test may want to hold on to.
  window.elocute = page;
  document.body.classList.add("ready");
}

start().catch((error) => { $("count").textContent = `This mesh cannot be shown: ${error.message}`; });
