// Curves that give the mouth that was heard, as elocute.articulation.mouth_solver with
// elocute.motion.mouth_response: the least change of the rules, contacts among the conditions.
import { clip } from "./arrays.js";

/** How far the styles' amplitude, spread and so on go into a mouth, and how strongly it moves. */
export class Mouth {
  constructor({ mouth, curves, measures }, style, strength) {
    const { FREEDOM, TOLERANCE_MM, BITTEN_MOST, PARTING, ROUNDED, WIDTH, PROTRUSION, UPPER } = mouth;
    this.at = mouth;
    this.curves = curves;
    this.style = style;
    this.strength = strength;
    this.size = curves.length;
    const index = (name) => curves.indexOf(name);
    this.parting = PARTING.map(index).filter((at) => at >= 0);
    this.rounded = ROUNDED.map(index);
    this.bitten = index("mouthLabiodental");
    this.jaw = index("jawOpen");
    this.close = index("mouthClose");
    this.free = Float64Array.from(curves, (name) => (FREEDOM[name] ?? 0) * (name.startsWith("mouthUpperUp") ? style.upper_lip : 1));
    this.noise = [...measures.map((name) => TOLERANCE_MM[name] ** 2), 0];
    // The last column is the tie of lips: mouthClose less jawOpen.
    this.effects = mouth.effects.map((row, curve) => [...row, Number(curve === this.close) - Number(curve === this.jaw)]);
    this.most = measures.map((_, measure) => curves.reduce((sum, name, curve) => sum + (BITTEN_MOST[name] ?? 0) * mouth.effects[curve][measure], 0));
    this.gains = measures.map(() => style.amplitude);
    this.gains[WIDTH] = style.spread;
    this.gains[PROTRUSION] = style.rounding;
    this.gains[UPPER] *= style.upper_lip;
  }

  /** Curves (curve,) of a row of the rules, by what is asked of that row. */
  row(rules, asked) {
    const { LABIODENTAL, OPENING, WIDTH, PROTRUSION, JAW, UPPER, LOWER, BITTEN_MM, rest } = this.at;
    const { sealed, teeth } = asked, apart = (1 - sealed) * (1 - teeth);
    const base = Float64Array.from(rules, (value) => value * (1 - asked.rest) * this.strength);
    for (const at of this.rounded) base[at] *= this.style.rounding;
    for (const at of this.parting) base[at] *= apart;
    base[this.bitten] = Math.max(base[this.bitten], teeth) * (1 - sealed);
    const free = this.free.map((far) => far);
    free[this.jaw] *= 1 - asked.stiff;
    for (const at of this.parting) free[at] *= apart;
    const wanted = this.wanted(rules, asked);
    wanted[OPENING] += sealed * (rest[OPENING] - wanted[OPENING]);
    wanted[JAW] -= teeth * Math.max(wanted[JAW] - rest[JAW] - this.most[JAW], 0);
    wanted[WIDTH] += teeth * Math.max(rest[WIDTH] + this.most[WIDTH] - wanted[WIDTH], 0);
    // A lip that is rolled in stands back and is short: nothing else makes up for that.
    for (const measure of [PROTRUSION, UPPER, LOWER]) wanted[measure] += teeth * this.effects[this.bitten][measure];
    wanted[OPENING] += teeth * (1 - sealed) * (BITTEN_MM - wanted[OPENING]);
    wanted.push(-LABIODENTAL.jawOpen * teeth * (1 - sealed));
    return this.corrected(base.map((value) => clip(value)), wanted, free.map((far) => far ** 2), Math.max(sealed, teeth));
  }

  /** Measures, mm, of the mouth without contacts. */
  wanted(rules, { mm, rounding, parted, settled, rest: resting, breath }) {
    const { rest, COVERED_MM, EASE_MM, OPENING, WIDTH, UPPER } = this.at, { strength, style, gains } = this;
    const moved = mm.map((value, measure) => value - rest[measure]);
    moved[UPPER] += COVERED_MM;
    const ruled = rules.reduce((sum, value, curve) => sum + value * this.effects[curve][WIDTH], 0);
    moved[WIDTH] += rounding * (ruled - moved[WIDTH]);
    // Towards the least they slow down, so that near closures differ from each other.
    const least = (parted - rest[OPENING]) * Math.min(1, strength);
    const lips = least + EASE_MM * softplus((gains[OPENING] * strength * moved[OPENING] - least) / EASE_MM);
    const wanted = moved.map((value, measure) => rest[measure] + (1 - settled) * strength * gains[measure] * value);
    let still = strength * style.parted_mm;
    if (still) still -= rest[OPENING];
    const open = rest[OPENING] + (1 - resting) * lips + resting * still;
    wanted[OPENING] = Math.max(open, rest[OPENING] + gains[OPENING] * strength * breath);
    return wanted;
  }

  /** Least squares within 0 and 1: what has met a limit stays there, and the others take its part. */
  corrected(start, wanted, free, gate) {
    const { ROUNDS, SEALED_TO, UNSEALED, CLOSE_MOST, rest } = this.at, { effects, noise, close, jaw } = this;
    const size = wanted.length;
    noise[size - 1] = (SEALED_TO / Math.max(gate, UNSEALED)) ** 2;
    let current = start;
    for (let round = 0; round < ROUNDS; round++) {
      const held = start.map((value, curve) => (free[curve] > 0 ? value : current[curve]));
      const left = wanted.map((value, measure) => value - (rest[measure] ?? 0));
      const inner = noise.map((value, row) => noise.map((_, column) => (row === column ? value : 0)));
      effects.forEach((own, curve) => {
        for (let row = 0; row < size; row++) {
          left[row] -= held[curve] * own[row];
          if (free[curve]) for (let column = 0; column < size; column++) inner[row][column] += free[curve] * own[row] * own[column];
        }
      });
      const shares = solved(inner, left);
      const unbounded = held.map((value, curve) => value + free[curve] * effects[curve].reduce((sum, effect, row) => sum + effect * shares[row], 0));
      current = unbounded.map((value) => clip(value));
      current[close] = Math.min(current[close], current[jaw] + CLOSE_MOST);
      const limited = current.map((value, curve) => Number(value !== unbounded[curve]));
      if (!limited.includes(1)) break; // the next round would give the same
      free = free.map((far, curve) => (limited[curve] ? 0 : far));
    }
    return current;
  }
}

/** log(1 + exp(x)) without overflow. */
const softplus = (x) => Math.max(x, 0) + Math.log1p(Math.exp(-Math.abs(x)));

/** The solution of a positive definite system, by elimination. */
function solved(matrix, side) {
  const size = side.length, result = side.slice();
  for (let row = 0; row < size; row++) {
    for (let below = row + 1; below < size; below++) {
      const factor = matrix[below][row] / matrix[row][row];
      for (let column = row; column < size; column++) matrix[below][column] -= factor * matrix[row][column];
      result[below] -= factor * result[row];
    }
  }
  for (let row = size - 1; row >= 0; row--) {
    for (let column = row + 1; column < size; column++) result[row] -= matrix[row][column] * result[column];
    result[row] /= matrix[row][row];
  }
  return result;
}
