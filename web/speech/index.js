// Speech to curves of a face, in the browser alone: the model `talkers` of Elocute, streamed.
import { Resampler, resamplingDelay } from "./resample.js";
import { Talkers } from "./talkers.js";
import { livePace, Trunk, trunkLookahead, TrunkRows } from "./trunk.js";

function refuse(what, found, allowed) {
  throw new RangeError(`${what}: found ${found}; allowed: ${allowed}`);
}

function checked(what, value, [low, high]) {
  if (!(typeof value === "number" && value >= low && value <= high)) refuse(what, value, `${Math.ceil(100 * low) / 100} to ${high}`);
  return value;
}

/** A style's numbers, by its name or as they are. */
function styleOf(given, styles) {
  if (typeof given !== "string") return { ...styles.plain, ...given };
  return styles[given] ?? refuse("style", given, Object.keys(styles).join(", "));
}

/** What a URL leads to; anything else is returned as it is. */
async function fetched(source, read) {
  if (typeof source !== "string" && !(source instanceof URL)) return source;
  const answer = await fetch(source);
  if (!answer.ok) throw new Error(`${source}: found status ${answer.status}; allowed: a file that is there`);
  return answer[read]();
}

/** Open a stream of curves; index.d.ts says what it takes. */
export async function createSpeech({ ort, trunk, tables, ...settings }) {
  const runtime = ort ?? (await import("onnxruntime-web/wasm"));
  const [network, known] = await Promise.all([fetched(trunk, "arrayBuffer"), fetched(tables, "json")]);
  const session = network.run ? network : await runtime.InferenceSession.create(new Uint8Array(network));
  return new Speech(runtime, session, known, settings);
}

class Speech {
  constructor(ort, session, tables, { rate = 16000, fps = 60, lookahead = "exact", style = "plain", strength = 1 }) {
    const { SPEECH_RATE, LOOKAHEAD_MAX_S, RATE_RANGE } = tables.stream, { BETWEEN_ROWS_S, decoder_lookahead_s } = tables.talkers;
    this.session = session;
    this.tables = tables;
    this.rate = checked("rate", Number.isInteger(rate) ? rate : `${rate}`, RATE_RANGE);
    this.fps = checked("fps", fps, [1, 240]);
    this.live = lookahead !== "exact";
    const resampling = resamplingDelay(tables.resampling, rate, SPEECH_RATE, this.live), { paces } = tables.trunk;
    const late = (pace) => resampling + BETWEEN_ROWS_S + trunkLookahead(tables, pace);
    if (this.live) {
      this.lookahead = checked("lookahead", lookahead, [late(livePace(tables, 0)), LOOKAHEAD_MAX_S]);
      this.pace = livePace(tables, this.lookahead - resampling - BETWEEN_ROWS_S);
      this.waiting = this.lookahead - late(this.pace);
    } else {
      this.pace = paces.whole;
      this.waiting = decoder_lookahead_s;
      this.lookahead = resampling + trunkLookahead(tables, paces.whole) + decoder_lookahead_s;
    }
    this.resampler = new Resampler(tables.resampling, rate, SPEECH_RATE, this.live);
    this.trunk = new Trunk(ort, session, tables, this.pace);
    this.model = new Talkers(tables, styleOf(style, tables.styles), checked("strength", strength, [0, 2]));
    this.rows = new TrunkRows();
    this.firstRow = this.samples = this.given = 0;
    this.ended = false;
    this.busy = Promise.resolve();
  }

  get names() { return this.model.names; }

  /** The frames that are certain now, or with a look-ahead can be made; null where there is none. */
  async push(samples) {
    if (this.ended) refuse("push", "sound after its end", "a new stream");
    if (!(samples instanceof Float32Array || samples instanceof Int16Array)) refuse("push", typeof samples, "a Float32Array within ±1, or an Int16Array");
    const block = samples instanceof Int16Array ? Float32Array.from(samples, (value) => value * this.tables.stream.INT16) : samples.slice();
    if (!block.every(Number.isFinite)) refuse("push", "NaN or infinity", "numbers");
    return this.inTurn(() => this.heard(block));
  }

  /** End the sound: the remaining frames. */
  async flush() {
    if (this.ended) return null;
    this.ended = true;
    return this.inTurn(() => this.last());
  }

  /** Blocks are taken whole, one after the other, whoever waits for them. */
  inTurn(work) {
    const done = this.busy.then(work);
    this.busy = done.catch(() => {});
    return done;
  }

  async heard(block) {
    const size = Math.floor(this.rate / this.tables.stream.PIECES_PER_S), parts = [];
    for (let at = 0; at < block.length;) {
      // Each piece gives one row or none, so that a frame knows as much however sound is cut.
      const until = this.live ? Math.min(block.length, at + size - (this.samples % size)) : block.length;
      parts.push(await this.piece(block.subarray(at, until)));
      at = until;
    }
    return this.together(parts.filter(Boolean));
  }

  async piece(block) {
    const { FEATURE_RATE } = this.tables.trunk;
    this.samples += block.length;
    this.rows = this.rows.with(await this.trunk.push(this.resampler.push(block)));
    const certain = (this.firstRow + this.rows.count - 1) / FEATURE_RATE - this.waiting;
    return this.answer(Math.floor(certain * this.fps) + 1 - this.given);
  }

  async last() {
    if (!this.samples) return null;
    const rest = await this.trunk.push(this.resampler.push(new Float32Array(), true));
    this.rows = this.rows.with(rest).with(await this.trunk.flush());
    const total = Math.max(1, Math.ceil((this.samples / this.rate) * this.fps - 1e-6));
    return this.rows.count ? this.answer(total - this.given, true) : null;
  }

  answer(count, last = false) {
    if (count <= 0) return null;
    const { rows, firstRow, live, fps, names, given } = this, { HISTORY_S } = this.tables.stream;
    const coming = live && !last ? this.trunk.comingPhones : new Float32Array();
    const values = this.model.curves({ rows, first: firstRow, coming, live }, { first: given, count, fps });
    this.given += count;
    const old = Math.floor((this.given / fps - HISTORY_S) * this.tables.trunk.FEATURE_RATE) - firstRow;
    const drop = Math.min(old, rows.count - 1);
    if (drop > 0) {
      this.rows = rows.part(drop);
      this.firstRow += drop;
    }
    return { first: given, count, names, fps, values };
  }

  together(parts) {
    if (parts.length < 2) return parts[0] ?? null;
    const count = parts.reduce((sum, part) => sum + part.count, 0);
    const values = new Float32Array(count * this.names.length);
    for (const part of parts) values.set(part.values, (part.first - parts[0].first) * this.names.length);
    return { ...parts[0], count, values };
  }
}
