// Where landmarks that are not set yet should lie: an average face laid over those that are.
import * as THREE from "three";

const NEEDED = 4;
const TURNS = 60; // of the power method; it has converged long before

// The turn, size and shift that take `from` nearest to `to` (Horn 1987: the greatest
// eigenvector of a 4 by 4 matrix is the turn's quaternion).
export function similarity(from, to) {
  const middle = (points) => points.reduce((sum, p) => sum.add(p), new THREE.Vector3()).divideScalar(points.length);
  const [a, b] = [middle(from), middle(to)];
  const sums = Array.from({ length: 3 }, () => [0, 0, 0]);
  let spread = 0, wide = 0;
  from.forEach((point, index) => {
    const x = point.clone().sub(a).toArray(), y = to[index].clone().sub(b).toArray();
    for (let i = 0; i < 3; i++) for (let j = 0; j < 3; j++) sums[i][j] += x[i] * y[j];
    spread += x[0] ** 2 + x[1] ** 2 + x[2] ** 2;
    wide += y[0] ** 2 + y[1] ** 2 + y[2] ** 2;
  });
  const [[xx, xy, xz], [yx, yy, yz], [zx, zy, zz]] = sums;
  const matrix = [
    [xx + yy + zz, yz - zy, zx - xz, xy - yx],
    [yz - zy, xx - yy - zz, xy + yx, zx + xz],
    [zx - xz, xy + yx, yy - xx - zz, yz + zy],
    [xy - yx, zx + xz, yz + zy, zz - xx - yy],
  ];
  const [w, x, y, z] = greatest(matrix);
  return { turn: new THREE.Quaternion(x, y, z, w), scale: Math.sqrt(wide / spread), from: a, to: b };
}

// The eigenvector of the greatest eigenvalue; the matrix is shifted until all are above zero.
function greatest(matrix) {
  const shift = Math.max(...matrix.map((row) => row.reduce((sum, value) => sum + Math.abs(value), 0)));
  let best = [1, 0.1, 0.2, 0.3];
  for (let turn = 0; turn < TURNS; turn++) {
    const next = matrix.map((row, i) => row.reduce((sum, value, j) => sum + value * best[j], shift * best[i]));
    const length = Math.hypot(...next) || 1;
    best = next.map((value) => value / length);
  }
  return best;
}

// How the average face lies on the mesh, or null while too few landmarks are set.
export function laid(average, set) {
  const known = [...set.keys()];
  return known.length < NEEDED ? null : similarity(known.map((each) => average[each]), known.map((each) => set.get(each)));
}

function moved(fit, point) {
  return point.clone().sub(fit.from).applyQuaternion(fit.turn).multiplyScalar(fit.scale).add(fit.to);
}

// The place of one landmark: the average face's, moved as its neighbours among those that are
// set lie off it.
export function expected(index, average, set) {
  const fit = laid(average, set);
  if (!fit) return null;
  const shift = new THREE.Vector3();
  let total = 0;
  for (const [each, place] of set) {
    const weight = 1 / (1e-6 + average[each].distanceToSquared(average[index]));
    shift.addScaledVector(place.clone().sub(moved(fit, average[each])), weight);
    total += weight;
  }
  return moved(fit, average[index]).add(shift.divideScalar(total));
}

// A view that has the face upright, from the front.
export function portrait(average, set) {
  const fit = laid(average, set);
  if (!fit) return null;
  const box = new THREE.Box3().setFromPoints(average);
  return {
    middle: moved(fit, box.getCenter(new THREE.Vector3())),
    toward: new THREE.Vector3(0, 0, 1).applyQuaternion(fit.turn),
    up: new THREE.Vector3(0, 1, 0).applyQuaternion(fit.turn),
    height: fit.scale * (box.max.y - box.min.y),
  };
}
