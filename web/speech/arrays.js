// What several steps share: rows of numbers, runs, and easing.

export const clip = (value, low = 0, high = 1) => Math.min(high, Math.max(low, value));

/** 3s² - 2s³: starts and ends without a jerk. */
export const smoothstep = (share) => share * share * (3 - 2 * share);

/** Starts and stops (exclusive) of all runs of rows of which something is so. */
export function runs(count, inside) {
  const found = [];
  for (let row = 0, start = -1; row <= count; row++) {
    const now = row < count && Boolean(inside(row));
    if (now && start < 0) start = row;
    if (!now && start >= 0) {
      found.push([start, row]);
      start = -1;
    }
  }
  return found;
}

/** One array after another. */
export function joined(first, second) {
  if (!first.length) return second;
  if (!second.length) return first;
  const both = new Float32Array(first.length + second.length);
  both.set(first);
  both.set(second, first.length);
  return both;
}

/** A Gaussian blur of (row,) that sees `reach` rows on both sides; the end values repeat. */
export function blurred(column, deviation, reach) {
  const kernel = Float64Array.from({ length: 2 * reach + 1 }, (_, at) => Math.exp(-0.5 * ((at - reach) / deviation) ** 2));
  const sum = kernel.reduce((total, weight) => total + weight, 0);
  return Float64Array.from(column, (_, row) => {
    let value = 0;
    for (let at = 0; at < kernel.length; at++) value += kernel[at] * column[clip(row + at - reach, 0, column.length - 1)];
    return value / sum;
  });
}
