// Where a mouth rests, and where it breathes in, as elocute.articulation.rest.
import { clip, runs, smoothstep } from "./arrays.js";

const FAR = 1e6; // rows

/** Speech without noises that are too short, and with pauses that are. */
function speaking(silence, rate, starts, { SPEECH_AT_LEAST_S, PAUSE_S, EDGE_S }) {
  const count = silence.length, now = Array.from(silence, (share) => share < 0.5);
  for (const [start, stop] of runs(count, (row) => now[row])) {
    if ((stop - start) / rate < SPEECH_AT_LEAST_S) now.fill(false, start, stop);
  }
  for (const [start, stop] of runs(count, (row) => !now[row])) {
    const edge = (start === 0 && starts) || stop === count;
    const alone = start === 0 && (stop === count || !starts);
    if ((stop - start) / rate < (edge ? EDGE_S : PAUSE_S) && !alone) now.fill(true, start, stop);
  }
  return now;
}

/** Rows since the last sound and until the next; FAR and more where there is none. */
function soundsBeside(now) {
  const count = now.length, passed = new Float64Array(count), coming = new Float64Array(count);
  for (let row = 0, last = -FAR; row < count; row++) passed[row] = row - (now[row] ? (last = row) : last);
  for (let row = count - 1, next = 2 * FAR; row >= 0; row--) coming[row] = (now[row] ? (next = row) : next) - row;
  return { passed, coming };
}

/** How far a mouth is at rest, by the posterior (row,) of silence; `starts` where the take begins. */
export function restShare(silence, rate, starts, tables) {
  const { passed, coming } = soundsBeside(speaking(silence, rate, starts, tables));
  const wake = tables.WAKE_S * rate, settle = tables.SETTLE_S * rate;
  const waking = starts && coming.length ? clip(coming[0], 1, wake) : wake;
  const settling = passed.length ? clip(passed.at(-1), 1, settle) : settle;
  return Float64Array.from(passed, (since, row) => {
    const settled = smoothstep(clip(since / (coming[row] > FAR / 2 ? settling : settle)));
    return settled * smoothstep(clip(coming[row] / (since > FAR / 2 ? waking : wake)));
  });
}

/** The same of what was heard so far: nobody knows how long a pause will be. */
export function liveRestShare(silence, rate, unheard, tables) {
  const { PAUSE_S, LIVE_WAKE_S, LIVE_SETTLE_S, LIVE_EARLY_ROWS } = tables, count = silence.length;
  const now = Array.from(silence, (value) => value < 0.5), share = new Float64Array(count);
  const begins = now.map((_, row) => row).filter((row) => !row || now[row] !== now[row - 1] || row === unheard);
  let before = 0;
  begins.forEach((start, place) => {
    const stop = begins[place + 1] ?? count;
    for (let row = start; row < stop; row++) {
      const lasted = (row - start + 1) / rate;
      share[row] = start < unheard ? 1 : before * (1 - smoothstep(clip(lasted / LIVE_WAKE_S)));
      if (start >= unheard && !now[start]) share[row] = Math.max(share[row], smoothstep(clip((lasted - PAUSE_S) / LIVE_SETTLE_S)));
    }
    before = share[stop - 1];
  });
  // It wakes before a sound, as far as that is known.
  return Float64Array.from(share, (_, row) => {
    let least = share[row];
    for (let at = row + 1; at <= row + LIVE_EARLY_ROWS; at++) least = Math.min(least, at < count ? share[at] : before);
    return least;
  });
}

/** How far a mouth is open to breathe in before it speaks. */
export function breathShare(silence, rate, starts, tables) {
  const { passed, coming } = soundsBeside(speaking(silence, rate, starts, tables));
  const { BREATH_PAUSE_S: [shortest, longest], OPENED_S, BREATH_S } = tables;
  return Float64Array.from(passed, (since, row) => {
    const lasted = starts && since > FAR / 2 ? row : since, ahead = coming[row] / rate;
    const pause = coming[row] > FAR / 2 ? 0 : (lasted + coming[row]) / rate;
    const deep = smoothstep(clip((pause - shortest) / (longest - shortest)));
    const begin = clip(pause, OPENED_S + 0.1, BREATH_S);
    const opening = smoothstep(clip((begin - ahead) / (begin - OPENED_S)));
    return deep * opening * smoothstep(clip(ahead / OPENED_S));
  });
}
