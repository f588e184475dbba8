// Where the opening of the lips lies, and how far light comes in through it: read off the places of
// posed vertices, as src/elocute/head/mouth_opening.py reads it. Joints turn teeth and lips alike.
import * as THREE from "three";

const NO_LIPS = 1e6;

export class Mouth {
  // mesh: the part of the head that has the lips, or null; stage: as export/html.py writes it.
  constructor(mesh, stage) {
    this.mesh = mesh;
    this.stage = stage;
    this.opening = Array.from({ length: 3 }, () => new THREE.Vector4(0, 0, 0, NO_LIPS));
    this.uniforms = { opening: { value: this.opening } };
  }

  update() {
    if (!this.mesh) return;
    const { upper, lower, corners, ends, lit_from, reach, least_reach } = this.stage;
    const { position } = this.mesh.geometry.attributes;
    const at = (index) => new THREE.Vector3().fromBufferAttribute(position, index);
    const half = Math.floor(upper.length / 2);
    const middle = at(upper[half]).lerp(at(lower[half]), lit_from);
    const [right, left] = corners.map((index) => middle.clone().lerp(at(index), ends));
    const height = upper.reduce((sum, index, pair) => sum + at(index).distanceTo(at(lower[pair])), 0)
      / upper.length / 2;
    [right, middle, left].forEach((place, index) =>
      // @ts-expect-error: a vector gives its three numbers.
      this.opening[index].set(...place, least_reach + reach * height));
  }
}

// That of a head; one without lips is open wide.
export function mouthOf(meshes, stage) {
  const found = stage && meshes.find((mesh) => mesh.userData.record.name === stage.material);
  return new Mouth(found ?? null, stage);
}
