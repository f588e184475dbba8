// The head in the page's .glb: a mesh for each material, joints, shapes and their motion.
// Shapes are sparse, and few are at work at a time: they are added up here, not on the graphics
// card, which would hold every shape of every vertex and look each of them up.
import { MeshoptDecoder } from "../node_modules/meshoptimizer/meshopt_decoder_reference.js";
import * as THREE from "three";

const GLB_HEADER = 12, CHUNK_HEADER = 8;
const ARRAYS = { 5121: Uint8Array, 5123: Uint16Array, 5125: Uint32Array, 5126: Float32Array };
const CLAMP_TO_EDGE = 33071;
const WIDTHS = { SCALAR: 1, VEC2: 2, VEC3: 3, VEC4: 4, MAT4: 16 };
const ATTRIBUTES = {
  POSITION: "position", NORMAL: "normal", TEXCOORD_0: "uv", COLOR_0: "color",
  JOINTS_0: "skinIndex", WEIGHTS_0: "skinWeight", _OCCLUSION: "_occlusion", _STRAND: "_strand",
  _FOLDS_0: "_folds_0", _FOLDS_1: "_folds_1", _FOLDS_2: "_folds_2", _FOLDS_3: "_folds_3",
};
const MOVED = { POSITION: "position", NORMAL: "normal" };

const MESHOPT = "EXT_meshopt_compression", WEBP = "EXT_texture_webp";

function unpackedView({ byteOffset, byteLength, byteStride, count, mode, filter }, size, binary) {
  const bytes = new Uint8Array(size), source = binary.subarray(byteOffset, byteOffset + byteLength);
  MeshoptDecoder.decodeGltfBuffer(bytes, count, byteStride, source, mode, filter);
  return bytes;
}

class Glb {
  constructor(bytes) {
    this.unpacked = [];
    const size = new DataView(bytes.buffer, bytes.byteOffset).getUint32(GLB_HEADER, true);
    const text = bytes.subarray(GLB_HEADER + CHUNK_HEADER, GLB_HEADER + CHUNK_HEADER + size);
    this.json = JSON.parse(new TextDecoder().decode(text));
    this.binary = bytes.subarray(GLB_HEADER + 2 * CHUNK_HEADER + size);
  }

  bytes(index) {
    const { byteOffset, byteLength, extensions } = this.json.bufferViews[index];
    const packed = extensions?.[MESHOPT];
    if (!packed) return this.binary.subarray(byteOffset, byteOffset + byteLength);
    this.unpacked[index] ??= unpackedView(packed, byteLength, this.binary);
    return this.unpacked[index];
  }

  values(view, type, count, start = 0) {
    const { buffer, byteOffset } = this.bytes(view);
    return new ARRAYS[type](buffer, byteOffset + start, count);
  }

  array(index) {
    const { bufferView, componentType, count, type } = this.json.accessors[index];
    return this.values(bufferView, componentType, count * WIDTHS[type]);
  }

  attribute(index) {
    const { type, normalized } = this.json.accessors[index];
    return new THREE.BufferAttribute(this.array(index), WIDTHS[type], normalized);
  }

  // The vertices that a shape moves, and by how much.
  moves(index) {
    const { sparse, componentType } = this.json.accessors[index];
    if (!sparse) return null;
    const { count, indices, values } = sparse;
    return {
      rows: this.values(indices.bufferView, indices.componentType, count, indices.byteOffset),
      by: this.values(values.bufferView, componentType, 3 * count, values.byteOffset),
    };
  }

  async picture(texture) {
    const { source, extensions } = this.json.textures[texture];
    const { bufferView, mimeType } = this.json.images[source ?? extensions[WEBP].source];
    const file = new Blob([this.bytes(bufferView)], { type: mimeType });
    return createImageBitmap(file, { premultiplyAlpha: "none", colorSpaceConversion: "none" });
  }
}

// What primitives over the same corners share: where corners are, and how shapes move them.
class Corners {
  constructor(glb, { attributes, indices, targets = [] }) {
    this.geometry = new THREE.BufferGeometry();
    for (const [name, ours] of Object.entries(ATTRIBUTES)) {
      if (name in attributes) this.geometry.setAttribute(ours, glb.attribute(attributes[name]));
    }
    this.geometry.setIndex(glb.attribute(indices));
    this.parts = Object.entries(MOVED).map(([name, ours]) => {
      const attribute = this.geometry.getAttribute(ours).clone();
      const rest = this.geometry.getAttribute(ours).array;
      this.geometry.setAttribute(ours, attribute.setUsage(THREE.DynamicDrawUsage));
      return { attribute, rest, shapes: targets.map((target) => glb.moves(target[name])) };
    });
    this.moved = false;
  }

  pose(weights) {
    const active = [];
    weights.forEach((weight, index) => {
      if (weight && this.parts[0].shapes[index]) active.push(index);
    });
    if (!active.length && !this.moved) return;
    this.moved = active.length > 0;
    for (const { attribute, rest, shapes } of this.parts) {
      attribute.array.set(rest);
      for (const index of active) if (shapes[index]) add(attribute.array, shapes[index], weights[index]);
      attribute.needsUpdate = true;
    }
  }
}

function add(array, { rows, by }, weight) {
  for (let at = 0, from = 0; at < rows.length; at++, from += 3) {
    const to = 3 * rows[at];
    array[to] += weight * by[from];
    array[to + 1] += weight * by[from + 1];
    array[to + 2] += weight * by[from + 2];
  }
}

// The frames of an animation; between two of them, what lies between.
export class Frames {
  // weights: (frame, shape) or null; turns: the node, its quaternions, where the first begins and
  // how far on the next frame's is.
  constructor(fps, count, weights, turns) {
    this.fps = fps;
    this.count = count;
    this.weights = weights;
    this.turns = turns;
  }

  static of(glb, fps) {
    const { samplers, channels } = glb.json.animations?.[0] ?? { samplers: [], channels: [] };
    const turns = [];
    let weights = null, count = 0;
    for (const { sampler, target } of channels) {
      const { input, output } = samplers[sampler];
      ({ count } = glb.json.accessors[input]);
      if (target.path === "weights") weights = glb.array(output);
      else turns.push([target.node, glb.array(output), 0, 4]);
    }
    return new Frames(fps, count, weights, turns);
  }

  pose(time, weights, nodes) {
    const at = THREE.MathUtils.clamp(time * this.fps, 0, this.count - 1);
    const here = Math.floor(at), next = Math.min(here + 1, this.count - 1), share = at - here;
    if (this.weights) {
      const width = weights.length;
      for (let index = 0; index < width; index++) {
        const [from, to] = [this.weights[here * width + index], this.weights[next * width + index]];
        weights[index] = from + share * (to - from);
      }
    }
    for (const [node, turns, first, step] of this.turns) {
      const turn = nodes[node].quaternion.fromArray(turns, first + step * here);
      turn.slerp(new THREE.Quaternion().fromArray(turns, first + step * next), share);
    }
  }
}

export class Head {
  // bytes: of a .glb as export/gltf.py writes it; its pictures come later, by `pictures`.
  constructor(bytes, fps) {
    this.bytes = bytes;
    this.glb = new Glb(bytes);
    const { meshes, materials } = this.glb.json;
    const [{ primitives, extras }] = meshes;
    this.frames = Frames.of(this.glb, fps);
    this.weights = new Float32Array(extras.targetNames.length);
    this.scene = new THREE.Group();
    this.nodes = this.addNodes();
    const corners = new Map();
    this.meshes = primitives.map((primitive) => {
      const { POSITION } = primitive.attributes;
      if (!corners.has(POSITION)) corners.set(POSITION, new Corners(this.glb, primitive));
      const mesh = this.mesh(corners.get(POSITION).geometry);
      mesh.name = materials[primitive.material].name;
      mesh.frustumCulled = false;
      mesh.morphTargetInfluences = /** @type {any} */ (this.weights);
      mesh.morphTargetDictionary = Object.fromEntries(extras.targetNames.map((name, index) => [name, index]));
      mesh.userData.record = materials[primitive.material];
      return mesh;
    });
    this.corners = [...corners.values()];
    this.scene.add(...this.meshes);
    this.scene.updateMatrixWorld(true);
    this.bind();
  }

  addNodes() {
    const { nodes, skins } = this.glb.json;
    const made = nodes.map(({ name, translation = [0, 0, 0] }) => {
      const node = new THREE.Bone();
      node.name = name;
      node.position.fromArray(translation);
      return node;
    });
    nodes.forEach(({ children = [] }, index) => children.forEach((each) => made[index].add(made[each])));
    if (skins) this.scene.add(...skins[0].joints.map((each) => made[each]).filter((each) => !each.parent));
    return made;
  }

  joint(index) { return this.nodes[this.glb.json.skins[0].joints[index]]; }

  mesh(geometry) {
    return this.glb.json.skins ? new THREE.SkinnedMesh(geometry) : new THREE.Mesh(geometry);
  }

  bind() {
    const [skin] = this.glb.json.skins ?? [];
    if (!skin) return;
    const inverse = this.glb.array(skin.inverseBindMatrices);
    const skeleton = new THREE.Skeleton(
      skin.joints.map((each) => this.nodes[each]),
      skin.joints.map((_, index) => new THREE.Matrix4().fromArray(inverse, 16 * index)),
    );
    this.meshes.forEach((mesh) => mesh.bind(skeleton, new THREE.Matrix4()));
  }

  // The pictures of all materials, by the index of their texture.
  async pictures() {
    const { textures = [], materials, samplers = [] } = this.glb.json;
    const colors = new Set(materials.map((each) => each.pbrMetallicRoughness.baseColorTexture?.index));
    return Promise.all(textures.map(async ({ sampler }, index) => {
      const texture = new THREE.Texture(await this.glb.picture(index));
      texture.flipY = false;
      const clamped = samplers[sampler]?.wrapS === CLAMP_TO_EDGE;
      texture.wrapS = texture.wrapT = clamped ? THREE.ClampToEdgeWrapping : THREE.RepeatWrapping;
      texture.colorSpace = colors.has(index) ? THREE.SRGBColorSpace : THREE.NoColorSpace;
      texture.needsUpdate = true;
      return texture;
    }));
  }

  // The weights of the shapes at a time, and the joints' turns.
  at(time) {
    if (this.frames.count) this.frames.pose(time, this.weights, this.nodes);
  }

  pose(time) {
    this.at(time);
    this.move();
  }

  // As the weights are now.
  move() {
    this.corners.forEach((each) => each.pose(this.weights));
  }
}
