// What a sound is made of over time, up to 8 kHz; computed for what is in view.
import { computed, signal } from "@preact/signals";
import { Drawing } from "./drawing";
import { thePlayer } from "./studio";
import { perSecond, visible } from "./scale";
import { told } from "./studio";

const RATE = 16000, SIZE = 512, FLOOR_DB = -70, RANGE_DB = 75;

const samples = signal<{ source: string; values: Float32Array } | null>(null);
let asked = "";

async function hear(source: string) {
  if (asked === source) return;
  asked = source;
  try {
    const bytes = await (await fetch(source)).arrayBuffer();
    const sound = await new OfflineAudioContext(1, 1, RATE).decodeAudioData(bytes);
    samples.value = { source, values: sound.getChannelData(0) };
  } catch (error) {
    told(error);
  }
}

const hann = Float32Array.from({ length: SIZE }, (_, at) => 0.5 - 0.5 * Math.cos((2 * Math.PI * at) / SIZE));

// Powers of the lower half, in place of a Fourier transform's parts (radix 2).
export function powers(real: Float32Array): Float32Array {
  const size = real.length, imaginary = new Float32Array(size);
  for (let at = 1, back = 0; at < size; at++) {
    let bit = size >> 1;
    for (; back & bit; bit >>= 1) back ^= bit;
    back ^= bit;
    if (at < back) [real[at], real[back]] = [real[back], real[at]];
  }
  for (let half = 1; half < size; half *= 2) {
    for (let each = 0; each < half; each++) {
      const angle = (-Math.PI * each) / half, c = Math.cos(angle), s = Math.sin(angle);
      for (let one = each; one < size; one += 2 * half) {
        const two = one + half;
        const r = real[two] * c - imaginary[two] * s, i = real[two] * s + imaginary[two] * c;
        real[two] = real[one] - r; imaginary[two] = imaginary[one] - i;
        real[one] += r; imaginary[one] += i;
      }
    }
  }
  return Float32Array.from({ length: size / 2 }, (_, at) => real[at] ** 2 + imaginary[at] ** 2);
}

export function Spectrogram({ height }: { height: number }) {
  const { source } = thePlayer();
  hear(source);
  const heard = computed(() => (samples.value?.source === source ? samples.value.values : null));
  return (
    <div class="spectrogram">
      <Drawing height={height} label="Spectrogram" draw={(pen, width, tall, ink) => {
        const values = heard.value;
        if (!values) return;
        const [from] = visible.value, rate = perSecond();
        pen.fillStyle = ink("accent");
        for (let x = 0; x < width; x++) {
          const first = Math.round((from + x / rate) * RATE) - SIZE / 2;
          const power = powers(hann.map((weight, at) => weight * (values[first + at] ?? 0)));
          for (let y = 0; y < tall; y++) {
            const level = 10 * Math.log10(power[Math.floor(((tall - 1 - y) / tall) * (SIZE / 2))] / SIZE + 1e-12);
            pen.globalAlpha = Math.min(1, Math.max(0, (level - FLOOR_DB) / RANGE_DB)) ** 1.5;
            if (pen.globalAlpha > 0.02) pen.fillRect(x, y, 1, 1);
          }
        }
        pen.globalAlpha = 1;
      }} />
    </div>
  );
}
