// The model of many talkers: rows of the trunk to curves, as elocute.models.talkers.
import { blurred, clip } from "./arrays.js";
import { Coarticulation } from "./coarticulation.js";
import { Contacts } from "./contacts.js";
import { Finish } from "./finish.js";
import { Mouth } from "./mouth.js";
import { breathShare, liveRestShare, restShare } from "./rest.js";

export class Talkers {
  constructor(tables, style, strength) {
    this.tables = tables;
    this.at = tables.talkers;
    this.style = style;
    this.rules = new Coarticulation(tables);
    this.contacts = new Contacts(tables);
    this.mouth = new Mouth(tables, style, strength);
    this.finish = new Finish(tables, style);
    this.hissed = this.at.HISSED.map((phone) => tables.phones.indexOf(phone));
    this.rounded = this.at.ROUNDED.map((name) => tables.curves.indexOf(name));
  }

  get names() { return this.finish.names; }

  /**
   * Curves (count, curve) of frames from `span.first` on.
   *
   * `heard`: rows of the trunk from row `first` on, `coming` log-posteriors behind them, and
   * whether it is `live`.
   */
  curves({ rows, first, coming, live }, { first: frame, count, fps }) {
    const { FEATURE_RATE: rate, TEMPO_ROWS, SEALED, AT_TEETH } = this.at, { phones, curves } = this.tables;
    const size = phones.length, posteriors = new Float32Array(rows.phones.length + coming.length);
    rows.phones.forEach((value, at) => { posteriors[at] = Math.exp(value); });
    coming.forEach((value, at) => { posteriors[rows.phones.length + at] = Math.exp(value); });
    const known = posteriors.length / size, lastRow = first + known - 1;
    const begin = Math.max(first, Math.floor((frame / fps) * rate) - TEMPO_ROWS);
    const until = Math.min(lastRow, Math.ceil(((frame + count - 1) / fps) * rate) + TEMPO_ROWS);
    const stop = Math.max(begin, until) + 1, near = stop - begin, from = begin - first;
    const ruled = this.rules.rows(posteriors, rate, first, begin, near);
    const asked = this.asked({ rows, first, live, posteriors, rate, from, near });
    const states = this.contacts.states(posteriors, first);
    const met = [SEALED, AT_TEETH].map((kind) => this.contacts.decoded(posteriors, rate, kind, states));
    const times = Float64Array.from({ length: near }, (_, row) => (from + row) / rate);
    const sealed = this.contacts.track(met[SEALED], times), teeth = this.contacts.track(met[AT_TEETH], times);
    const shapes = curves.length, mouths = new Float32Array(near * shapes);
    for (let row = 0; row < near; row++) {
      const rules = ruled.subarray(row * shapes, (row + 1) * shapes);
      const rounding = this.at.ROUNDED_SHARE * clip(this.rounded.reduce((sum, curve) => sum + rules[curve], 0));
      mouths.set(this.mouth.row(rules, { ...asked(row), rounding, sealed: sealed[row], teeth: teeth[row] }), row * shapes);
    }
    return this.frames(mouths, begin, met, { frame, count, fps, rate, first });
  }

  /** What is asked of the mouth in a row, but for contacts and rounding. */
  asked({ rows, first, live, posteriors, rate, from, near }) {
    const { at, tables } = this, starts = first === 0, silence = this.contacts.column(posteriors, at.SILENCE);
    const still = Float64Array.from({ length: near }, (_, row) => (this.silent(rows, from + row) >= 1 ? 1 : 0));
    const stillness = blurred(still, at.STILL_ROWS, at.TEMPO_ROWS);
    const rest = live
      ? liveRestShare(silence, rate, starts ? this.unheard(rows, silence) : 0, tables.rest)
      : restShare(silence, rate, starts, tables.rest);
    const breath = live ? null : breathShare(silence, rate, starts, tables.rest);
    const pressed = this.contacts.evidence(posteriors, this.contacts.pools[at.SEALED]);
    const hissed = this.contacts.heard(posteriors, this.hissed);
    const wanted = this.wanted(rows, from, near);
    return (row) => {
      const mm = wanted.map((column) => column[row]), place = from + row;
      return {
        mm,
        parted: (1 - silence[place]) * (at.PARTED_MM + (at.NEARLY_MM - at.PARTED_MM) * clip(pressed[place] / at.MAYBE)),
        stiff: at.STIFF_JAW * hissed[place],
        breath: breath ? breath[place] * clip(at.SURER * (mm[at.OPENING] - at.UNSURE_MM), 0, at.BREATH_MM) : 0,
        rest: rest[place],
        settled: rest[place] * (at.RESTS + (1 - at.RESTS) * stillness[row]),
      };
    };
  }

  /** The share of silence in a row, 1 without sound; the last row holds beyond the end. */
  silent(rows, row) {
    const place = Math.min(row, rows.count - 1), { phones } = this.tables;
    return rows.quiet[place] ? 1 : Math.fround(Math.exp(rows.phones[place * phones.length + this.at.SILENCE]));
  }

  /** Rows at the beginning in which nothing is heard and nothing said. */
  unheard(rows, silence) {
    for (let row = 0; row < silence.length; row++) {
      if (silence[row] < 0.5 || (row < rows.count && this.silent(rows, row) < 1)) return row;
    }
    return silence.length;
  }

  /** For each measure (row,) mm of a mouth that speaks in a style. */
  wanted(rows, from, near) {
    const { middle_mm, spread_mm } = this.at, fields = this.tables.trunk.MOUTH_FIELDS.length;
    return middle_mm.map((middle, measure) => {
      const heard = Float64Array.from({ length: near }, (_, row) => rows.mouth[Math.min(from + row, rows.count - 1) * fields + measure]);
      return this.atTempo(heard).map((value) => middle + spread_mm[measure] * value);
    });
  }

  /** Movements blurred for a slow style and sharpened for a quick one. */
  atTempo(z) {
    const { style, at } = this, { plain } = this.tables.styles;
    const octaves = Math.log2((style.anticipation_s + style.carry_s) / (plain.anticipation_s + plain.carry_s));
    if (Math.abs(octaves) < 0.01) return z;
    const slow = blurred(z, Math.min(at.SLOWEST_ROWS, at.SLOWER_ROWS * Math.abs(octaves)), at.TEMPO_ROWS);
    return octaves > 0 ? slow : z.map((value, row) => value + at.SHARPER * Math.min(1, -octaves) * (value - slow[row]));
  }

  /** Rows read at frames, linear between them, and finished. */
  frames(mouths, begin, met, { frame, count, fps, rate, first }) {
    const shapes = this.tables.curves.length, last = mouths.length / shapes - 1, { SEALED, AT_TEETH } = this.at;
    const times = Float64Array.from({ length: count }, (_, at) => (frame + at) / fps - first / rate);
    const seals = this.contacts.track(met[SEALED], times), teeth = this.contacts.track(met[AT_TEETH], times);
    const values = new Float32Array(count * this.names.length), mouth = new Float32Array(shapes);
    for (let at = 0; at < count; at++) {
      const place = clip(((frame + at) * rate) / fps - begin, 0, last);
      const below = Math.floor(place), above = Math.min(below + 1, last), share = place - below;
      for (let curve = 0; curve < shapes; curve++) {
        mouth[curve] = clip(mouths[below * shapes + curve] * (1 - share) + mouths[above * shapes + curve] * share);
      }
      values.set(this.finish.frame(mouth, seals[at], teeth[at]), at * this.names.length);
    }
    return values;
  }
}
