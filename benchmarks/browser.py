"""`web/speech` in Chromium: how quick it is, and how good beside Python and beside other packages.

    python -m benchmarks.browser                               # how quick, on one thread
    python -m benchmarks.browser --data DATA --every 6 --clips 4
    python -m benchmarks.browser --data DATA --every 6 --clips 4 --peers FOLDER

FOLDER is where `npm install @met4citizen/headaudio@0.1.0 wawa-lipsync@0.0.2` was run. These hear a
sound in an OfflineAudioContext that stops for every frame of 60 a second, and their visemes move
the same head by its own visemes; wawa-lipsync names one viseme at a time, eased as in its example.
They answer late: their frames are taken earlier by what suits their openings of GRID best.

Openings are those of `benchmarks.mouth_motion` on GRID and the talkers, seals those of
`benchmarks.seals`. Speed is the best of some runs, as the machine may be busy.
"""

from __future__ import annotations

import argparse
import tempfile
from dataclasses import replace
from pathlib import Path

import numpy as np

from benchmarks.mouth_motion import Animated, Recording, compared
from benchmarks.seals import REFERENCE, chosen, takes
from elocute.animation import animate
from elocute.array_types import Float32Array
from elocute.audio.read import read_audio
from elocute.audio.waveform import SPEECH_RATE, Waveform
from elocute.evaluation.phone_mouth_scores import phone_mouth_score
from elocute.evaluation.tracked_mouths import (
    TrackedClip,
    find_tracked_mouths,
    read_tracked_mouth,
)
from elocute.head.builtin import load_builtin_head
from elocute.head.viseme_shapes import VISEME_SHAPES
from elocute.motion.curves import Curves, motion_from_curves
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import measure_mouth
from elocute.numerics.correlation import pearson
from recipes.encoder.reference import read_reference
from tests.support.browser_speech import SpeechPage, open_speech_page

CLIP = Path(__file__).parents[1] / "src" / "elocute" / "assets" / "example.flac"
FPS, RUNS = 60, 5
PACES: tuple[float | str, ...] = ("exact", 0.21, 0.25, 0.3, 0.4)
LATE = range(19)  # that a peer's frames may be taken earlier
VISEMES = {"I": "ih", "O": "oh", "U": "ou"}  # others have the names of ours

TIMED = """
const [size, lookahead] = given, { createSpeech, ort, tables, session, floats } = elocute;
const samples = await floats("samples"), pushes = [];
const speech = await createSpeech({ ort, tables, trunk: session, lookahead });
const begin = performance.now();
for (let at = 0; at < samples.length; at += size) {
  const before = performance.now();
  await speech.push(samples.subarray(at, at + size));
  pushes.push(performance.now() - before);
}
await speech.flush();
return [performance.now() - begin, pushes];
"""

PEERS = """
const { floats } = elocute, RATE = 48000, FPS = 60, QUANTUM = 128;
const heard = async (name) => {
  const buffer = new AudioBuffer({ length: (await floats(name)).length, sampleRate: 16000 });
  buffer.copyToChannel(await floats(name), 0);
  return buffer;
};
// A worklet's messages come from another thread: as long as a frame and more is waited for them.
const turn = () => new Promise((next) => { setTimeout(next, 20); });
// Stop at every frame of a sound: `each` is told the frame's number; what it gives is kept.
async function atFrames(context, seconds, each) {
  const kept = [];
  for (let frame = 1; frame < seconds * FPS; frame++) {
    const at = (Math.round((frame / FPS) * RATE / QUANTUM) * QUANTUM) / RATE;
    context.suspend(at).then(async () => {
      await turn();
      kept.push(each(frame));
      context.resume();
    });
  }
  await context.startRendering();
  return kept;
}
const { HeadAudio } = await import("/peers/@met4citizen/headaudio/dist/headaudio.min.mjs");
const { Lipsync, VISEMES } = await import("/peers/wawa-lipsync/dist/wawa-lipsync.es.js");
async function open(name) {
  const buffer = await heard(name), length = Math.ceil(buffer.duration * RATE);
  const context = new OfflineAudioContext(1, length, RATE);
  const source = new AudioBufferSourceNode(context, { buffer });
  source.start();
  return { buffer, context, source };
}
elocute.headaudio = async (name) => {
  const { buffer, context, source } = await open(name), values = {};
  await context.audioWorklet.addModule("/peers/@met4citizen/headaudio/dist/headworklet.min.mjs");
  const node = new HeadAudio(context);
  await node.loadModel("/peers/@met4citizen/headaudio/dist/model-en-mixed.bin");
  node.onvalue = (viseme, value) => { values[viseme] = value; };
  source.connect(node);
  source.connect(context.destination);
  return atFrames(context, buffer.duration, () => {
    node.update(1000 / FPS);
    return { ...values };
  });
};
elocute.wawa = async (name) => {
  const { buffer, context, source } = await open(name);
  const real = [window.AudioContext, performance.now];
  let now = 0;
  window.AudioContext = function () { return context; };
  const lips = new Lipsync(), values = {};
  window.AudioContext = real[0];
  source.connect(lips.analyser);
  lips.analyser.connect(context.destination);
  performance.now = () => now;
  try {
    return await atFrames(context, buffer.duration, (frame) => {
      now = (frame / FPS) * 1000;
      lips.processAudio();
      const vowel = lips.state === "vowel";
      for (const viseme of Object.values(VISEMES)) {
        const old = values[viseme] ?? 0, speaks = viseme === lips.viseme;
        values[viseme] = old + (speaks - old) * (vowel ? 0.1 : 0.2) * (speaks ? 2 : 1);
      }
      return { ...values };
    });
  } finally {
    performance.now = real[1];
  }
};
"""


def needed(there: object, what: str) -> None:
    if not there:
        raise SystemExit(f"this benchmark needs {what}")


def speed(page: SpeechPage) -> None:
    """Milliseconds of one thread, a second of sound."""
    samples = read_audio(CLIP, sample_rate=SPEECH_RATE).samples
    seconds = len(samples) / SPEECH_RATE
    page.give("samples", samples)
    for lookahead, size in [("exact", len(samples)), *((pace, 320) for pace in PACES)]:
        runs = []
        for _ in range(RUNS):
            before_s = page.processor_s()
            took_ms, pushes = page.run(TIMED, size, lookahead)
            runs.append((page.processor_s() - before_s, took_ms / 1000, pushes))
        spent_s, _, pushes = min(runs, key=lambda run: run[0])
        took_s = min(run[1] for run in runs)
        how = "whole" if size > SPEECH_RATE else f"{lookahead}, blocks of 20 ms"
        print(
            f"{how:24} {spent_s / seconds:.3f} CPU s per s, {seconds / spent_s:.1f} x real time"
            f" ({seconds / took_s:.1f} by the clock);"
            f" a push, 99 %: {np.quantile(pushes, 0.99):.1f} ms",
            flush=True,
        )


def nearness(page: SpeechPage) -> None:
    """How far curves are from Python's, and Python's from its own with the sound rounded anew."""
    samples = read_audio(CLIP, sample_rate=SPEECH_RATE).samples
    page.give("samples", samples)
    spoken = "return elocute.spoken(await elocute.floats('samples'), 16000, {})"

    def in_python(sound: Float32Array) -> Float32Array:
        return animate(sound, rate=SPEECH_RATE, fps=FPS, life=0).curves.values

    wanted = in_python(samples)
    draw = np.random.default_rng(0).uniform(-1, 1, len(samples)) * 2e-7
    for name, values in (
        ("browser", np.reshape(page.run(spoken), wanted.shape)),
        ("Python, sound rounded anew", in_python((samples * (1 + draw)).astype(np.float32))),
    ):
        apart = np.abs(values - wanted)
        middle, seldom = np.quantile(apart.max(axis=1), [0.5, 0.99])
        print(
            f"{name}: frames apart from Python's by {middle:.4f}, 99 % {seldom:.4f}, most"
            f" {apart.max():.4f}; rms {np.sqrt(np.mean(apart**2)):.4f}"
        )


def in_browser(page: SpeechPage, lookahead: float | str) -> Animated:
    """What moves the head as `web/speech` does."""
    open_one = "(await elocute.createSpeech({ ...elocute, trunk: elocute.session })).names"
    names = tuple(page.run(f"return {open_one}"))

    def moved(sound: Waveform) -> Motion:
        page.give("samples", sound.samples)
        spoken = "return elocute.spoken(await elocute.floats('samples'), 320, given[0])"
        values = page.run(spoken, {"lookahead": lookahead})
        return motion_of(np.array(values, np.float32).reshape(-1, len(names)), names)

    return moved


def by_visemes(page: SpeechPage, peer: str) -> Animated:
    """What moves the head by the visemes of another package, each sound heard once."""
    names = tuple(dict.fromkeys(name for shape in VISEME_SHAPES.values() for name in shape))
    known: dict[bytes, Float32Array] = {}

    def table(sound: Waveform) -> Float32Array:
        page.give("samples", sound.samples)
        frames = page.run(f"return elocute.{peer}('samples')")
        values = np.zeros((len(frames) + 1, len(names)), np.float32)
        for number, frame in enumerate(frames, 1):
            for viseme, weight in frame.items():
                own = str(viseme).removeprefix("viseme_")
                for name, share in VISEME_SHAPES[VISEMES.get(own, own)].items():
                    values[number, names.index(name)] += weight * share
        return np.clip(values, 0, 1)

    def moved(sound: Waveform) -> Motion:
        key = sound.samples.tobytes()
        if key not in known:
            known[key] = table(sound)
        return motion_of(known[key], names)

    return moved


def motion_of(values: Float32Array, names: tuple[str, ...]) -> Motion:
    """Of the built-in head, by curves (frame, curve)."""
    return motion_from_curves(load_builtin_head(), Curves(values, names, FPS))


def earlier(moved: Animated, frames: int) -> Animated:
    """The same, so many frames earlier; the last one holds."""

    def taken(sound: Waveform) -> Motion:
        motion = moved(sound)
        held = np.repeat(motion.weights[-1:], frames, axis=0)
        return replace(motion, weights=np.concatenate([motion.weights[frames:], held]))

    return taken


def best_late(data: Path, every: int, moved: Animated) -> int:
    """By how many frames they are to be taken earlier for the best openings of GRID."""
    r = []
    for clip in grid_clips(data, every):
        person = read_tracked_mouth(clip)
        motion = moved(read_audio(person.sound, sample_rate=SPEECH_RATE))
        opening = measure_mouth(motion)["opening_mm"].astype(float)
        times = (person.times_s - person.offset_s)[person.valid]
        at = [
            np.interp(times + late / FPS, np.arange(len(opening)) / FPS, opening) for late in LATE
        ]
        r.append([pearson(each, person.opening[person.valid]) for each in at])
    mean = np.nanmean(r, axis=0)
    print("r of openings by frames taken earlier:", np.round(mean, 2).tolist())
    return LATE[int(mean.argmax())]


def grid_clips(data: Path, every: int) -> list[TrackedClip]:
    """Each so many of the development set."""
    names = set((data / "grid_s1" / "dev.txt").read_text(encoding="utf-8").split()[::every])
    return [c for c in find_tracked_mouths(data / "grid_s1" / "clips") if c.path.stem in names]


def openings(data: Path, every: int, model: Animated) -> dict[str, list[Recording]]:
    """Recordings of GRID, and of the talkers of the development set."""
    clips = {
        "GRID": grid_clips(data, every),
        "talkers": find_tracked_mouths(data / "talkers" / "dev"),
    }
    return {
        name: [each for clip in some if (each := compared(clip, model)) is not None]
        for name, some in clips.items()
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--data", type=Path, help="folder with grid_s1/, talkers/ and speech/")
    parser.add_argument("--every", type=int, default=6, help="take each Nth clip of GRID")
    parser.add_argument("--clips", type=int, default=4, help="of each source of speech, for seals")
    parser.add_argument("--peers", type=Path, help="folder with node_modules of other packages")
    parser.add_argument("--peers-alone", action="store_true", help="nothing of ours beside them")
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as name:
        folder = Path(name)
        if given.peers:
            (folder / "peers").symlink_to((given.peers / "node_modules").resolve())
        with open_speech_page(needed, folder) as page:
            if not given.data:
                speed(page)
                nearness(page)
                return
            ways = {} if given.peers_alone else own_ways(page)
            if given.peers:
                ways |= peer_ways(page, given.data, given.every)
            compare(ways, given.data, given.every, given.clips)


def own_ways(page: SpeechPage) -> dict[str, Animated]:
    """Python and the browser."""
    return {
        "Python, whole": lambda sound: animate(sound, fps=FPS, life=0).motion,
        "browser, exact": in_browser(page, "exact"),
        "browser, 0.25 s": in_browser(page, 0.25),
    }


def peer_ways(page: SpeechPage, data: Path, every: int) -> dict[str, Animated]:
    """Other packages, each as late as it is."""
    page.run(PEERS)
    ways = {}
    for peer in ("headaudio", "wawa"):
        moved = by_visemes(page, peer)
        late = best_late(data, every, moved)
        ways[f"{peer}, {1000 * late // FPS} ms earlier"] = earlier(moved, late)
    return ways


def compare(ways: dict[str, Animated], data: Path, every: int, clips: int) -> None:
    """A line for each way of moving the head."""
    spoken = chosen(read_reference(REFERENCE, data / "speech"), clips)
    for name, way in ways.items():
        found = openings(data, every, way)
        r = [np.mean([each.r[k] for each in some]) for some in found.values() for k in (0, 1, 3)]
        score = phone_mouth_score(takes(spoken, way, []))
        seals, teeth = score.closures, score.labiodentals
        print(
            f"{name:28} opening, width, jaw: {' '.join(f'{each:.3f}' for each in r)};"
            f" seals right {seals.right}, false {1 - seals.precision:.3f},"
            f" missed {1 - seals.recall:.3f} of {seals.wanted}; f, v {teeth.recall:.3f}",
            flush=True,
        )


if __name__ == "__main__":
    main()
