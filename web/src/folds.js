// Folds that come with expressions: how strong they are is read off the places of posed vertices, as
// src/elocute/head/folds.py reads it. Joints turn both of a pair alike, and change nothing.
const ZONES = 16;

export class Folds {
  // mesh: the part of the head that folds, at rest; stage: as export/html.py writes it;
  // image: of heights.
  constructor(mesh, stage, image) {
    this.mesh = mesh;
    this.stage = stage;
    this.strengths = new Float32Array(ZONES);
    this.uniforms = {
      folds_map: { value: image },
      fold_strengths: { value: this.strengths },
      fold_lines: { value: stage.lines },
      fold_step: { value: stage.step },
    };
    this.rest = this.lengths();
  }

  // Between the two of each pair.
  lengths() {
    const { position } = this.mesh.geometry.attributes;
    return this.stage.pairs.map(([one, two]) => Math.hypot(...["getX", "getY", "getZ"].map((axis) =>
      position[axis](two) - position[axis](one))));
  }

  update() {
    const { zone, weight, reach, depth } = this.stage;
    const posed = this.lengths(), shorter = new Float32Array(ZONES);
    zone.forEach((number, pair) => {
      shorter[number] += weight[pair] * (1 - posed[pair] / Math.max(this.rest[pair], 1e-9));
    });
    reach.forEach(([low, high], number) => {
      const share = Math.min(Math.max((shorter[number] - low) / (high - low), 0), 1);
      this.strengths[number] = depth * share * share * (3 - 2 * share);
    });
  }
}

// Those of a head, or null for one without.
export function foldsOf(meshes, stage, pictures) {
  if (!stage) return null;
  const found = meshes.find((mesh) => mesh.userData.record.name === stage.material);
  return new Folds(found, stage, pictures[found.userData.record.extras.folds]);
}
