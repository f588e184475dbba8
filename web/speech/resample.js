// Sound at another rate, block by block; the same however it is cut.
import { joined } from "./arrays.js";

// A steep filter, for sound that need not be answered at once: passes up to 0.91 of the band, as
// soxr does in Python, and waits for 6 ms of the lower rate.
const STEEP = { CROSSINGS: 96, CUTOFF: 0.957, BETA: 12.9 };

const divisor = (a, b) => (b ? divisor(b, a % b) : a);

/** The modified Bessel function of order zero. */
function bessel(x) {
  let sum = 1, term = 1;
  for (let at = 1; term > 1e-12 * sum; at++) sum += term *= (x / (2 * at)) ** 2;
  return sum;
}

/** (phase, 2 · reach) taps of a low pass for moments between two samples. */
function windowedSinc(phases, reach, slower, { CUTOFF, BETA }) {
  const taps = new Float32Array(phases * 2 * reach);
  for (let phase = 0; phase < phases; phase++) {
    const row = Float64Array.from({ length: 2 * reach }, (_, at) => {
      const apart = at + 1 - reach - phase / phases, angle = Math.PI * CUTOFF * slower * apart;
      return ((angle ? Math.sin(angle) / angle : 1) * bessel(BETA * Math.sqrt(Math.max(0, 1 - (apart / reach) ** 2)))) / bessel(BETA);
    });
    const sum = row.reduce((total, tap) => total + tap, 0);
    taps.set(row.map((tap) => tap / sum), phase * row.length);
  }
  return taps;
}

/** `push` sound of a rate, get it at another; prompt as elocute.audio.resampling_stream, or steep. */
export class Resampler {
  constructor(tables, rate, wanted, prompt) {
    this.rate = rate;
    this.wanted = wanted;
    if (rate === wanted) return;
    const filter = prompt ? tables : STEEP, common = divisor(rate, wanted), slower = Math.min(1, wanted / rate);
    this.up = wanted / common;
    this.down = rate / common;
    this.reach = Math.ceil(filter.CROSSINGS / slower);
    this.taps = windowedSinc(this.up, this.reach, slower, filter);
    this.kept = new Float32Array(this.reach); // nothing is before the first sample
    this.first = -this.reach; // number of the first sample that is kept
    this.given = this.taken = 0;
  }

  push(samples, last = false) {
    if (this.rate === this.wanted) return samples;
    const { up, down, reach, given } = this;
    this.taken += samples.length;
    this.kept = joined(this.kept, samples);
    if (last) this.kept = joined(this.kept, new Float32Array(reach));
    // Sample n of the result stands at n · down / up, and needs `reach` samples behind it.
    const known = Math.min(this.first + this.kept.length - reach, this.taken);
    const until = Math.max(given, Math.ceil((known * up) / down));
    const heard = new Float32Array(until - given);
    for (let at = given; at < until; at++) {
      const start = Math.floor((at * down) / up) - reach + 1 - this.first, tap = ((at * down) % up) * 2 * reach;
      let sum = 0;
      for (let place = 0; place < 2 * reach; place++) sum += this.kept[start + place] * this.taps[tap + place];
      heard[at - given] = sum;
    }
    if (until > given) {
      const used = Math.floor((until * down) / up) - reach - this.first;
      this.kept = this.kept.subarray(used);
      this.first += used;
      this.given = until;
    }
    return heard;
  }
}

/** How much resampling delays sound of a rate at most, s, as measured on a second of silence. */
export function resamplingDelay(tables, rate, wanted, prompt) {
  const stream = new Resampler(tables, rate, wanted, prompt), block = new Float32Array(Math.floor(rate / 100));
  let given = 0, late = 0;
  for (let number = 1; number <= 100; number++) {
    given += stream.push(block).length;
    late = Math.max(late, (number * block.length) / rate - given / wanted);
  }
  return late;
}
