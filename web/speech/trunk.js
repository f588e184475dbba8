// The trunk as elocute.encoders.trunk runs it: sound in, mouth and phones out, 50 times a second.
import { joined } from "./arrays.js";
import { Mel } from "./mel.js";

/** Rows by which each answer is late. */
function rowsLate(record, pace) {
  const hidden = record.mouth_layer * pace.ahead, phones = record.layers * pace.ahead;
  const mouth = pace.live ? record.live_late : Math.max(hidden + record.mouth_ahead, phones);
  return { hidden, mouth, phones };
}

/** How much later than a row's own time the sound must be known, s, its block included. */
export function trunkLookahead({ trunk, mel }, pace) {
  const { record, CONTEXT, FEATURE_RATE } = trunk;
  const late = Math.max(...Object.values(rowsLate(record, pace)));
  const heard = (mel.WINDOW / 2 + (pace.together - 1) * mel.HOP) / mel.SPEECH_RATE + CONTEXT / 100;
  return heard + (late + pace.block_rows) / FEATURE_RATE;
}

/** The cheapest pace whose look-ahead is within so many seconds, or else the quickest. */
export function livePace(tables, within) {
  const { whole: _, ...live } = tables.trunk.paces;
  const paces = Object.values(live);
  return paces.find((pace) => trunkLookahead(tables, pace) <= within + 1e-6) ?? paces.at(-1);
}

/** Sinusoids, each a whole number of turns in a period. */
function sinusoids({ period, width }) {
  const half = width / 2, waves = new Float32Array(period * width);
  for (let at = 0; at < half; at++) {
    const radians = Math.exp((-Math.log(10000) / (half - 1)) * at);
    const turns = Math.round((radians * period) / (2 * Math.PI));
    for (let place = 0; place < period; place++) {
      const angle = place * turns * ((2 * Math.PI) / period);
      waves[place * width + at] = Math.sin(angle);
      waves[place * width + half + at] = Math.cos(angle);
    }
  }
  return waves;
}

/**
 * Rows that came out: `mouth` (row, 7), `phones` (row, 40) as log-posteriors, and `quiet` (row,),
 * 1 where the sound is far below the loudest so far.
 */
export class TrunkRows {
  constructor(mouth = new Float32Array(), phones = new Float32Array(), quiet = new Float32Array()) {
    this.mouth = mouth;
    this.phones = phones;
    this.quiet = quiet;
  }

  get count() { return this.quiet.length; }

  part(first, stop = this.count) {
    const of = (values) => values.subarray((first * values.length) / this.count, (stop * values.length) / this.count);
    return this.count ? new TrunkRows(of(this.mouth), of(this.phones), of(this.quiet)) : this;
  }

  with(more) {
    return new TrunkRows(joined(this.mouth, more.mouth), joined(this.phones, more.phones), joined(this.quiet, more.quiet));
  }
}

export class Trunk {
  constructor(ort, session, tables, pace) {
    const { record, CONTEXT, REST_ROWS, QUIET_ROWS, ROW_SAMPLES, PHONES, MOUTH_FIELDS } = tables.trunk;
    const { width, layers, history, reach, mouth_ahead } = record;
    this.ort = ort;
    this.session = session;
    this.tables = tables;
    this.pace = pace;
    this.record = record;
    this.window = history + pace.ahead + pace.block_rows;
    const late = rowsLate(record, pace);
    this.late = Math.max(...Object.values(late));
    this.columns = { mouth: MOUTH_FIELDS.length, phones: PHONES.length };
    this.waiting = {
      mouth: new Float32Array((this.late - late.mouth) * this.columns.mouth),
      phones: new Float32Array((this.late - late.phones) * this.columns.phones),
    };
    // What each layer heard before: rows, and values in each.
    const heard = late.hidden + mouth_ahead;
    this.kept = {
      hidden_before: [Math.max(0, late.phones - heard), width, "hidden"],
      last_before: [Math.max(0, heard - late.phones), width, "last_new"],
      mouth_before: [reach, record.mouth_channels, "mouth_new"],
      live_mouth_before: [reach, record.live_channels, "live_mouth_new"],
      phones_before: [reach, record.phone_channels, "phones_new"],
    };
    for (let layer = 0; layer < layers; layer++) {
      for (const [kind, rows] of [["rows", pace.ahead], ["queries", pace.ahead], ["keys", history + pace.ahead], ["values", history + pace.ahead]]) {
        this.kept[`${kind}_${layer}`] = [rows, width, `${kind}_${layer}_new`];
      }
    }
    this.caches = Object.fromEntries(Object.entries(this.kept).map(([name, [rows, columns]]) => [name, new Last(rows * columns)]));
    this.positions = sinusoids(record);
    this.mel = new Mel(tables.mel, pace.together);
    this.bands = new Float32Array(CONTEXT * tables.mel.BANDS).fill(tables.mel.LEAST);
    this.samples = this.fed = 0;
    this.total = Infinity;
    this.near = Math.min(QUIET_ROWS, this.late);
    this.peaks = new Float32Array(2 * (this.late + this.near)).fill(-Infinity);
    this.loudest = tables.mel.QUIET;
    this.rest = new Float32Array(REST_ROWS * ROW_SAMPLES);
    this.begun = false;
  }

  async push(samples) {
    this.samples += samples.length;
    await this.begin();
    return this.listen(samples);
  }

  /** Before the sound there is rest. */
  async begin() {
    if (this.begun) return;
    this.begun = true;
    await this.listen(this.rest);
  }

  async flush() {
    const { ROW_SAMPLES, REST_ROWS } = this.tables.trunk;
    await this.begin();
    const rows = Math.ceil(this.samples / ROW_SAMPLES);
    // What comes after the last row is not there: no row attends to it.
    this.total = 2 * REST_ROWS + rows;
    const short = rows * ROW_SAMPLES - this.samples;
    const padding = new Float32Array(short + (this.late + this.pace.block_rows) * ROW_SAMPLES);
    const returned = Math.max(0, this.fed - this.late - REST_ROWS);
    return (await this.listen(joined(this.rest, padding))).part(0, rows - returned);
  }

  /** Log-posteriors behind the rows that were given: mouths come later. */
  get comingPhones() { return this.waiting.phones; }

  /** Run all whole blocks. */
  async listen(samples) {
    const { CONTEXT, REST_ROWS, RUN_BLOCKS } = this.tables.trunk, { BANDS } = this.tables.mel;
    this.bands = joined(this.bands, this.mel.push(samples));
    this.peaks = joined(this.peaks, this.mel.peaks);
    let rows = new TrunkRows();
    for (;;) {
      const blocks = Math.floor((this.bands.length / BANDS - 2 * CONTEXT + 1) / (2 * this.pace.block_rows));
      if (blocks <= 0) return rows;
      const before = Math.max(0, REST_ROWS + this.late - this.fed); // heard, but not given
      const answered = await this.run(Math.min(blocks, RUN_BLOCKS));
      rows = rows.with(answered.part(Math.min(before, answered.count)));
    }
  }

  /** The next rows through all layers. */
  async run(blocks) {
    const { record, pace, fed, window } = this, rows = blocks * pace.block_rows;
    const { CONTEXT } = this.tables.trunk, { BANDS } = this.tables.mel, { width, period } = record;
    const floats = (data, ...shape) => new this.ort.Tensor("float32", data, shape);
    const positions = new Float32Array(rows * width);
    const windows = new BigInt64Array(blocks * window);
    for (let row = 0; row < rows; row++) {
      const place = (fed + row) % period;
      positions.set(this.positions.subarray(place * width, (place + 1) * width), row * width);
    }
    for (let at = 0; at < windows.length; at++) windows[at] = BigInt(Math.floor(at / window) * pace.block_rows + (at % window));
    const frames = 2 * rows + 2 * CONTEXT - 1;
    const inputs = {
      bands: floats(this.bands.subarray(0, frames * BANDS), frames, BANDS),
      positions: floats(positions, rows, width),
      windows: new this.ort.Tensor("int64", windows, [blocks, window]),
    };
    for (const [name, [count, columns]] of Object.entries(this.kept)) inputs[name] = floats(this.caches[name].values, count, columns);
    for (let layer = 0; layer < record.layers; layer++) {
      inputs[`seen_${layer}`] = floats(this.seen(fed - layer * pace.ahead, blocks), blocks, 1, pace.block_rows, window);
    }
    const outputs = await inTurn(this.session, () => this.session.run(inputs));
    for (const [name, [, , heard]] of Object.entries(this.kept)) this.caches[name].add(outputs[heard].data);
    this.bands = this.bands.subarray(2 * rows * BANDS);
    this.fed += rows;
    const quiet = this.quiet(rows);
    const mouth = this.ready("mouth", outputs[pace.live ? "live_mouth" : "mouth"].data, rows);
    const phones = this.ready("phones", outputs.phones.data, rows).slice();
    quiet.forEach((still, row) => still && phones.set(this.tables.trunk.silence_alone, row * this.columns.phones));
    return new TrunkRows(mouth, phones, quiet);
  }

  ready(name, answered, rows) {
    const all = joined(this.waiting[name], answered), count = rows * this.columns[name];
    this.waiting[name] = all.slice(count);
    return all.subarray(0, count);
  }

  /** (row,) 1 where the next rows and those near them are far below the loudest so far. */
  quiet(rows) {
    const reach = 2 * this.near + 1, { SILENT_DECADES } = this.tables.trunk;
    const peak = (row) => Math.max(this.peaks[2 * row], this.peaks[2 * row + 1]);
    const still = new Float32Array(rows);
    for (let row = 0; row < rows; row++) {
      let near = -Infinity;
      for (let at = 0; at < reach; at++) near = Math.max(near, peak(row + at));
      this.loudest = Math.max(this.loudest, peak(row + this.near));
      still[row] = near < Math.fround(this.loudest - SILENT_DECADES) ? 1 : 0;
    }
    this.peaks = this.peaks.subarray(2 * rows);
    return still;
  }

  /** (block, 1, query, key) 0 where a row attends to another, far below elsewhere. */
  seen(start, blocks) {
    const { history } = this.record, { ahead, block_rows } = this.pace, { window } = this;
    const { FAR } = this.tables.trunk;
    const seen = new Float32Array(blocks * block_rows * window).fill(FAR);
    for (let block = 0, at = 0; block < blocks; block++) {
      const newest = start + block * block_rows;
      for (let query = newest - ahead; query < newest - ahead + block_rows; query++) {
        for (let place = 0; place < window; place++, at++) {
          const key = newest - history - ahead + place, apart = key - query;
          if (apart >= -history && apart <= ahead && key >= 0 && key < this.total) seen[at] = 0;
        }
      }
    }
    return seen;
  }
}

const turns = new WeakMap();

/** A session runs once at a time, whichever stream asks. */
function inTurn(session, work) {
  const done = (turns.get(session) ?? Promise.resolve()).then(work);
  turns.set(session, done.catch(() => {}));
  return done;
}

/** The last so many values of all that were added; they are moved seldom. */
class Last {
  constructor(size) {
    this.size = this.end = size;
    this.room = new Float32Array(3 * size);
  }

  get values() { return this.room.subarray(this.end - this.size, this.end); }

  add(fresh) {
    const added = fresh.subarray(Math.max(0, fresh.length - this.size));
    if (this.end + added.length > this.room.length) {
      this.room.copyWithin(0, this.end - this.size, this.end);
      this.end = this.size;
    }
    this.room.set(added, this.end);
    this.end += added.length;
  }
}
