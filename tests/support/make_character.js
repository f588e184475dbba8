// An avatar by three.js: a skinned head with a skeleton that rests turned, morph targets by the
// names that are given, one more morph that is not a face's, extras, and an idle animation.
import * as THREE from "three";
import { GLTFExporter } from "three/examples/jsm/exporters/GLTFExporter.js";

globalThis.FileReader = class {
  readAsArrayBuffer(blob) {
    blob.arrayBuffer().then((result) => {
      this.result = result;
      this.onloadend();
    });
  }
};

const { out, meshes, bones, trs, scene_turn } = JSON.parse(process.argv[2]);
const scene = new THREE.Scene();
scene.name = "Stage";
scene.userData = { stage: { kept: [1, 2.5, "three"] } };
const root = new THREE.Group();
root.name = "Armature";
root.rotation.set(...scene_turn);
scene.add(root);

const made = [];
for (const [name, parent, place, turn] of bones) {
  const bone = new THREE.Bone();
  bone.name = name;
  bone.position.set(...place);
  bone.rotation.set(...turn);
  (parent === null ? root : made[parent]).add(bone);
  made.push(bone);
}
root.updateMatrixWorld(true);

for (const [number, { name, targets, rest, place }] of meshes.entries()) {
  const ball = new THREE.SphereGeometry(0.1 - 0.03 * number, 12, 8);
  ball.translate(...place);
  const count = ball.attributes.position.count;
  ball.morphTargetsRelative = true;
  ball.morphAttributes.position = targets.map((target, index) => {
    const moved = new Float32Array(3 * count);
    if (!target.startsWith("still")) moved[3 * (index % count) + 1] = 0.001 * (index + 1);
    const attribute = new THREE.BufferAttribute(moved, 3);
    attribute.name = target;
    return attribute;
  });
  const material = new THREE.MeshStandardMaterial({ color: 0xcc9977 });
  material.name = `Skin ${number}`;
  material.userData = { note: "kept" };
  let mesh;
  if (made.length) {
    const indices = new Uint16Array(4 * count).fill(0);
    const weights = new Float32Array(4 * count);
    for (let vertex = 0; vertex < count; vertex++) {
      indices[4 * vertex] = made.length > 2 ? 2 : 0;
      weights[4 * vertex] = 1;
    }
    ball.setAttribute("skinIndex", new THREE.BufferAttribute(indices, 4));
    ball.setAttribute("skinWeight", new THREE.BufferAttribute(weights, 4));
    mesh = new THREE.SkinnedMesh(ball, material);
    root.add(mesh);
    mesh.bind(new THREE.Skeleton(made));
  } else {
    mesh = new THREE.Mesh(ball, material);
    root.add(mesh);
  }
  mesh.name = name;
  mesh.userData = { maker: "three.js" };
  mesh.updateMorphTargets();
  for (const [target, weight] of Object.entries(rest)) {
    mesh.morphTargetInfluences[mesh.morphTargetDictionary[target]] = weight;
  }
}

const clips = [];
if (made.length) {
  const turn = new THREE.Quaternion().setFromEuler(new THREE.Euler(0, 0.1, 0));
  const track = new THREE.QuaternionKeyframeTrack(
    `${made[0].name}.quaternion`, [0, 1], [0, 0, 0, 1, ...turn.toArray()]);
  clips.push(new THREE.AnimationClip("idle", 1, [track]));
}
new GLTFExporter().parse(
  scene,
  (data) => require("fs").writeFileSync(out, Buffer.from(data)),
  (error) => { throw error; },
  { binary: true, animations: trs ? clips : [], trs },
);
