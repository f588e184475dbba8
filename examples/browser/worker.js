// Speech to curves beside the page, so that drawing never waits for it.
import { createSpeech } from "../../web/speech/index.js";

const near = (name) => new URL(name, location.href).href;
const ready = (async () => {
  const ort = await import(near("ort.wasm.min.mjs"));
  ort.env.wasm.numThreads = 1;
  const tables = await (await fetch(near("tables.json"))).json();
  const { session } = await createSpeech({ ort, tables, trunk: near("trunk.onnx") });
  postMessage({ ready: true });
  return { ort, tables, trunk: session };
})();
ready.catch(({ message }) => postMessage({ error: message }));

/** @type {Promise<unknown>} */
let busy = ready;
let speech = null;

// { open: settings }, { samples } or { end: true }, in their order; `take` comes back with frames.
async function told({ take, open, samples, end }) {
  if (open) speech = await createSpeech({ ...(await ready), ...open });
  const frames = samples ? await speech.push(samples) : end ? await speech.flush() : null;
  if (frames || end) postMessage({ take, frames, end });
}

addEventListener("message", ({ data }) => {
  busy = busy.then(() => told(data)).catch(({ message }) => postMessage({ error: message }));
});
