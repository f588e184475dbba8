// What coarticulation makes of phones, as elocute.articulation.coarticulation at a frame a row.
import { clip, runs } from "./arrays.js";

export class Coarticulation {
  constructor({ coarticulation, phones, curves, styles }) {
    const { groups, targets, dominances, DIPHTHONGS, REACH_S, DIPHTHONG_S } = coarticulation;
    const index = (phone) => phones.indexOf(phone);
    this.groups = groups;
    this.phones = phones.length;
    this.curves = curves.length;
    this.silence = coarticulation.SILENCE;
    this.plain = styles.plain;
    this.diphthongs = Object.entries(DIPHTHONGS).map(([phone, [first, second]]) => [phone, first, second].map(index));
    this.seconds = { REACH_S, DIPHTHONG_S };
    // Columns: the pull of each curve, then that of each group.
    this.strengths = dominances[0].length;
    this.columns = this.curves + this.strengths;
    this.pulls = phones.map((_, phone) => [
      ...groups.map((group, curve) => dominances[phone][group] * targets[phone][curve]),
      ...dominances[phone],
    ]);
  }

  /**
   * Curves (count, curve) of rows from `begin` on, by posteriors (row, phone) from row `firstRow` on.
   * Beyond both ends there is silence.
   */
  rows(posteriors, rate, firstRow, begin, count) {
    const { columns, curves, groups } = this;
    const reach = Math.ceil(this.seconds.REACH_S * rate);
    const split = this.split(posteriors, Math.round(this.seconds.DIPHTHONG_S * rate));
    const known = split.length / this.phones, blended = new Float64Array(columns), pull = new Map();
    const silent = Float64Array.from(this.pulls[this.silence], (value, at) => (at < curves ? 0 : value));
    const pullOf = (row) => {
      if (row < 0 || row >= known) return silent;
      if (!pull.has(row)) pull.set(row, this.pull(split, row));
      return pull.get(row);
    };
    const result = new Float32Array(count * curves);
    for (let frame = 0; frame < count; frame++) {
      const place = ((begin + frame) / rate) * rate - firstRow, nearest = Math.floor(place);
      blended.fill(0);
      for (let tap = nearest - reach; tap <= nearest + reach; tap++) {
        const weight = this.weight((tap - place) / rate), values = pullOf(tap);
        for (let at = 0; at < columns; at++) blended[at] += weight * values[at];
      }
      pull.delete(nearest - reach);
      for (let curve = 0; curve < curves; curve++) {
        result[frame * curves + curve] = clip(blended[curve] / blended[curves + groups[curve]]);
      }
    }
    return result;
  }

  /** (1 + x) exp(-x) has no cusp at its own time; slower towards sounds to come or passed. */
  weight(lead) {
    const { anticipation_s, carry_s } = this.plain;
    const distance = lead > 0 ? (2 * lead) / anticipation_s : (-2 * lead) / carry_s;
    return (1 + distance) * Math.exp(-distance);
  }

  pull(posteriors, row) {
    const sum = new Float64Array(this.columns);
    for (let phone = 0; phone < this.phones; phone++) {
      const share = posteriors[row * this.phones + phone], pulls = this.pulls[phone];
      if (share) for (let at = 0; at < sum.length; at++) sum[at] += share * pulls[at];
    }
    return sum;
  }

  /** Hand each diphthong's posterior to its two vowels, first to last within each run. */
  split(posteriors, reach) {
    const result = Float32Array.from(posteriors), size = this.phones, count = posteriors.length / size;
    for (const [phone, first, second] of this.diphthongs) {
      const column = Float64Array.from({ length: count }, (_, row) => posteriors[row * size + phone]);
      const share = progress(column, reach);
      for (let row = 0; row < count; row++) {
        result[row * size + first] += column[row] * (1 - share[row]);
        result[row * size + second] += column[row] * share[row];
        result[row * size + phone] = 0;
      }
    }
    return result;
  }
}

/** Share 0 to 1 of a run's mass that lies before each row's middle, within `reach` rows. */
function progress(posterior, reach, floor = 0.02) {
  const share = new Float64Array(posterior.length);
  for (const [start, stop] of runs(posterior.length, (row) => posterior[row] > floor)) {
    const length = stop - start, sums = new Float64Array(length + 1);
    for (let at = 0; at < length; at++) sums[at + 1] = sums[at] + posterior[start + at];
    const far = length <= reach ? length : reach;
    for (let at = 0; at < length; at++) {
      const before = sums[Math.max(at - far, 0)], around = sums[Math.min(at + far + 1, length)] - before;
      share[start + at] = (sums[at + 1] - posterior[start + at] / 2 - before) / around;
    }
  }
  // A sharper hand-over: each vowel holds its own third of the sound.
  return share.map((value) => clip(1.5 * value - 0.25));
}
