// Log-mel energies as Whisper's encoder takes them, as elocute.audio.whisper_mel computes them.
import { joined } from "./arrays.js";

/** Samples at 16 kHz in, rows of 80 bands out; `peaks` are the loudest bands of the last rows, in decades. */
export class Mel {
  constructor(tables, together) {
    const { WINDOW, QUIET, window, weights } = tables;
    this.tables = tables;
    this.together = together;
    this.weights = weights;
    this.loudest = QUIET;
    this.pending = new Float32Array(WINDOW / 2);
    this.peaks = new Float32Array();
    this.window = Float32Array.from(window);
    // Waves over a quarter of a window: sums and differences of mirrored samples are enough.
    const half = WINDOW / 2, size = half / 2 + 1, bins = half + 1;
    this.cosines = new Float64Array(bins * size);
    this.sines = new Float64Array(bins * size);
    for (let bin = 0; bin < bins; bin++) {
      for (let at = 0; at < size; at++) {
        const angle = (2 * Math.PI * ((bin * at) % WINDOW)) / WINDOW;
        this.cosines[bin * size + at] = Math.cos(angle);
        this.sines[bin * size + at] = Math.sin(angle);
      }
    }
    this.power = new Float64Array(bins);
    // For bins that are even, and odd: what cosines weigh, and sines.
    this.even = [new Float64Array(size), new Float64Array(size)];
    this.odd = [new Float64Array(size), new Float64Array(size)];
  }

  push(samples) {
    const { HOP, WINDOW, BANDS, RANGE } = this.tables;
    const pending = joined(this.pending, samples);
    const whole = Math.max(0, Math.floor((pending.length - WINDOW) / HOP) + 1);
    const count = whole - (whole % this.together);
    const bands = new Float32Array(count * BANDS);
    this.peaks = new Float32Array(count);
    for (let frame = 0; frame < count; frame++) {
      this.spectrum(pending, frame * HOP);
      const row = bands.subarray(frame * BANDS, (frame + 1) * BANDS);
      this.decades(row);
      const peak = row.reduce((most, value) => Math.max(most, value));
      this.peaks[frame] = peak;
      this.loudest = Math.max(this.loudest, peak);
      for (let band = 0; band < BANDS; band++) row[band] = (Math.max(row[band], this.loudest - RANGE) + 4) / 4;
    }
    this.pending = pending.subarray(count * HOP);
    return bands;
  }

  /** The power of each bin of a window. */
  spectrum(samples, from) {
    const { window, cosines, sines, power } = this, size = window.length, half = size / 2, quarter = half / 2;
    const heard = (at) => samples[from + at] * window[at];
    for (let at = 0; at <= quarter; at++) {
      const near = heard(at), far = at < quarter ? heard(half - at) : 0;
      const nearer = at ? heard(size - at) : 0, farther = at && at < quarter ? heard(half + at) : 0;
      this.even[0][at] = near + nearer + far + farther;
      this.odd[0][at] = near + nearer - far - farther;
      this.even[1][at] = near - nearer - far + farther;
      this.odd[1][at] = near - nearer + far - farther;
    }
    this.odd[1][0] = this.even[1][0] = 0;
    for (let bin = 0; bin <= half; bin++) {
      const [real, imaginary] = bin % 2 ? this.odd : this.even;
      let along = 0, across = 0;
      for (let at = 0, place = bin * (quarter + 1); at <= quarter; at++, place++) {
        along += real[at] * cosines[place];
        across += imaginary[at] * sines[place];
      }
      power[bin] = along * along + across * across;
    }
  }

  decades(row) {
    const { FLOOR } = this.tables;
    this.weights.forEach(({ first, values }, band) => {
      let sum = 0;
      for (let at = 0; at < values.length; at++) sum += values[at] * this.power[first + at];
      row[band] = Math.log10(Math.max(sum, FLOOR));
    });
  }
}
