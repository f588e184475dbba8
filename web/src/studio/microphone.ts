// A recording by the microphone, as a .wav of 16 bits.
import { signal } from "@preact/signals";

export const recording = signal<number | null>(null); // s
let stop: (() => void) | null = null;

const HEADER_BYTES = 44;

export function wavOf(samples: Float32Array, rate: number): Blob {
  const view = new DataView(new ArrayBuffer(HEADER_BYTES + 2 * samples.length));
  const text = (at: number, letters: string) => [...letters].forEach((letter, place) => view.setUint8(at + place, letter.charCodeAt(0)));
  text(0, "RIFF");
  view.setUint32(4, view.byteLength - 8, true);
  text(8, "WAVEfmt ");
  const fields: [number, 2 | 4, number][] = [[16, 4, 16], [20, 2, 1], [22, 2, 1], [24, 4, rate], [28, 4, 2 * rate], [32, 2, 2], [34, 2, 16], [40, 4, 2 * samples.length]];
  fields.forEach(([at, wide, value]) => (wide === 2 ? view.setUint16(at, value, true) : view.setUint32(at, value, true)));
  text(36, "data");
  samples.forEach((value, at) => view.setInt16(HEADER_BYTES + 2 * at, Math.round(32767 * Math.max(-1, Math.min(1, value))), true));
  return new Blob([view], { type: "audio/wav" });
}

// Called once, it begins; called again, it ends and gives what was heard.
export async function record(give: (sound: Blob) => void) {
  if (stop) { stop(); return; }
  const stream = await navigator.mediaDevices.getUserMedia({ audio: true });
  const recorder = new MediaRecorder(stream), parts: Blob[] = [], since = performance.now();
  const timer = setInterval(() => { recording.value = (performance.now() - since) / 1000; }, 100);
  recording.value = 0;
  recorder.ondataavailable = ({ data }) => parts.push(data);
  recorder.onstop = async () => {
    clearInterval(timer);
    stream.getTracks().forEach((track) => track.stop());
    recording.value = stop = null;
    const context = new AudioContext();
    const sound = await context.decodeAudioData(await new Blob(parts).arrayBuffer());
    await context.close();
    give(wavOf(sound.getChannelData(0), sound.sampleRate));
  };
  stop = () => recorder.stop();
  recorder.start();
}
