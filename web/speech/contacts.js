// Where lips meet, decoded over a phrase, as elocute.articulation.contact_decoding.
import { clip, runs, smoothstep } from "./arrays.js";

/** Three rows averaged; fewer rows than that as numpy.convolve has them. */
function averaged(column) {
  const count = column.length, shift = count < 3 ? 0 : 1;
  return Float64Array.from(column, (_, row) => {
    let sum = 0;
    for (let at = row + shift - 2; at <= row + shift; at++) if (at >= 0 && at < count) sum += column[at] / 3;
    return sum;
  });
}

export class Contacts {
  constructor({ contacts, phones }) {
    const index = (phone) => phones.indexOf(phone);
    this.at = contacts;
    this.phones = phones.length;
    this.pools = contacts.POOLS.map((pool) => pool.map(index));
    this.single = phones.map((_, phone) => phone).filter((phone) => !this.pools.flat().includes(phone));
  }

  column(posteriors, phone) { return this.heard(posteriors, [phone]); }

  /** (row,) posterior of any of some phones. */
  heard(posteriors, phones) {
    const { phones: size } = this;
    return Float64Array.from({ length: posteriors.length / size }, (_, row) => phones.reduce((sum, phone) => sum + posteriors[row * size + phone], 0));
  }

  /** How likely a contact is, given that there is speech. */
  evidence(posteriors, phones) {
    const silence = this.column(posteriors, this.at.SILENCE);
    const speech = averaged(Float64Array.from(silence, (share) => 1 - share));
    return averaged(this.heard(posteriors, phones)).map((value, row) => value / (speech[row] + this.at.SPEECH_FLOOR));
  }

  /** Log-posteriors of states, the pooled contacts first, in single precision as Python has them. */
  scores(posteriors) {
    const { UNLIKELY, MISSING_NATS } = this.at, count = posteriors.length / this.phones;
    const states = this.pools.length + this.single.length, table = new Float32Array(count * states);
    const pooled = this.pools.map((pool) => this.heard(posteriors, pool));
    for (let row = 0; row < count; row++) {
      pooled.forEach((shares, state) => { table[row * states + state] = Math.log(Math.max(shares[row], UNLIKELY)) + MISSING_NATS[state]; });
      this.single.forEach((phone, at) => {
        table[row * states + pooled.length + at] = Math.log(Math.max(posteriors[row * this.phones + phone], UNLIKELY));
      });
    }
    return { table, states, count };
  }

  /** What each row is: a contact's number, or another. Windows lie at fixed rows of the take. */
  states(posteriors, firstRow) {
    const { BLOCK, BEFORE, AFTER } = this.at, scores = this.scores(posteriors);
    const found = new Int32Array(scores.count);
    for (let block = Math.floor(firstRow / BLOCK); block * BLOCK < firstRow + scores.count; block++) {
      const first = block * BLOCK - firstRow, path = this.path(scores, first - BEFORE, BEFORE + BLOCK + AFTER);
      for (let at = 0; at < BLOCK; at++) if (first + at >= 0 && first + at < scores.count) found[first + at] = path[BEFORE + at];
    }
    return found;
  }

  /** The best path through a window, of states that last two rows at least. */
  path({ table, states, count }, first, rows) {
    const cost = Math.fround(this.at.SWITCH_NATS), score = (row, state) => {
      const place = first + row;
      return place >= 0 && place < count ? table[place * states + state] : 0;
    };
    const old = Float32Array.from({ length: states }, (_, state) => score(0, state)), young = old.slice();
    const entered = new Int32Array(rows), stayed = new Uint8Array(rows * states);
    for (let row = 1; row < rows; row++) {
      const from = best(old), entering = Math.fround(old[from] - cost);
      entered[row] = from;
      for (let state = 0; state < states; state++) {
        const fits = score(row, state);
        stayed[row * states + state] = old[state] > young[state] ? 1 : 0;
        old[state] = Math.max(old[state], young[state]) + fits;
        young[state] = entering + fits;
      }
    }
    const path = new Int32Array(rows);
    let state = best(old), lasting = true;
    for (let row = rows - 1; row >= 0; row--) {
      path[row] = state;
      const before = lasting && stayed[row * states + state] === 1;
      if (!lasting) [state, lasting] = [entered[row], true];
      else lasting = before;
    }
    return path;
  }

  /** Stretches [start, end], s since the first row, in which lips meet each other or the teeth. */
  decoded(posteriors, rate, kind, states) {
    const { BESIDE, EVIDENCE_ROWS } = this.at, evidence = this.evidence(posteriors, this.pools[kind]);
    const likely = runs(states.length, (row) => states[row] === kind).filter(([start, stop]) =>
      sum(evidence.subarray(Math.max(0, start - BESIDE), stop + BESIDE)) >= EVIDENCE_ROWS[kind]);
    return this.shaped(likely, evidence, posteriors, rate, kind);
  }

  /** Stretches of rows as lips make them. */
  shaped(stretches, evidence, posteriors, rate, kind) {
    const { WAIT_S, RELEASE_S, SEALED, SILENCE, CORE, HUMMED, HUM_SHARE, BETWEEN_S } = this.at;
    const back = Math.round(WAIT_S * rate), silence = this.column(posteriors, SILENCE), hummed = this.column(posteriors, HUMMED);
    const early = kind === SEALED ? RELEASE_S : 0, contacts = [];
    for (let [start, stop] of stretches) {
      const most = Math.max(...evidence.subarray(start, stop));
      while (evidence[start] < CORE * most) start++;
      while (evidence[stop - 1] < CORE * most) stop--;
      let waiting = start;
      while (waiting > Math.max(0, start - back) && silence[waiting - 1] > 0.5) waiting--;
      const humming = sum(hummed.subarray(start, stop)) > HUM_SHARE * sum(evidence.subarray(start, stop));
      const [begin, end] = this.lasting(start / rate, (stop - 1) / rate, early, humming);
      let from = Math.min(waiting / rate, begin);
      if (contacts.length && from - contacts.at(-1)[1] < BETWEEN_S) [from] = contacts.pop();
      contacts.push([from, end]);
    }
    return contacts;
  }

  /** Not too short, and not too long unless it is hummed. */
  lasting(start, end, early, hummed) {
    const { HELD_S, LONGEST_S, HOLD_S } = this.at;
    if (hummed && end - start >= HELD_S) return [start, end];
    const stop = Math.min(Math.max(end - early, start), start + LONGEST_S);
    const short = Math.max(0, HOLD_S - (stop - start));
    return [start - short / 2, stop + short / 2];
  }

  /** How far lips are shut at moments, s: 1 in contact, eased to 0 outside. */
  track(contacts, times) {
    const { CLOSING_S, OPENING_S } = this.at, track = new Float64Array(times.length);
    let at = 0;
    for (const [start, end] of contacts) {
      // Times rise, and contacts come in order: back to where this one begins.
      while (at > 0 && times[at - 1] > start - CLOSING_S) at--;
      for (; at < times.length && times[at] < end + OPENING_S; at++) {
        const rise = 1 - clip((start - times[at]) / CLOSING_S), fall = 1 - clip((times[at] - end) / OPENING_S);
        track[at] = Math.max(track[at], smoothstep(Math.min(rise, fall)));
      }
    }
    return track;
  }
}

const sum = (values) => values.reduce((total, value) => total + value, 0);

function best(values) {
  let place = 0;
  for (let at = 1; at < values.length; at++) if (values[at] > values[place]) place = at;
  return place;
}
