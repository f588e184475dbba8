"""How far sounds that are no voice open the mouth.

    python -m benchmarks.noises
    python -m benchmarks.noises --model talkers dishes.flac

All but the recordings that are named are made by formula, so that anybody has the same.
"""

from __future__ import annotations

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from elocute.animation import animate
from elocute.array_types import Float64Array
from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.motion.mouth_measures import measure_mouth

RATE = 16_000
LENGTHS_S = (1.5, 3.0, 5.0, 8.0)
"""Each formula is tried at so many lengths; the table has the widest opening of them all."""
MODELS = ("articulation", "talkers")


def _harmonics(pitch_hz: Float64Array, count: int, decay: float = 1.0) -> Float64Array:
    """Harmonics of a pitch that moves, each `decay` powers weaker than the one before."""
    phase = 2 * np.pi * np.cumsum(pitch_hz) / RATE
    return np.sum([np.sin(n * phase) / n**decay for n in range(1, count + 1)], axis=0)


def _bursts(sound: Float64Array, starts_s: Sequence[float], into: Float64Array) -> Float64Array:
    for start in starts_s:
        first = round(start * RATE)
        into[first : first + len(sound)] += sound[: max(0, len(into) - first)]
    return into


def noises(seconds: float) -> dict[str, Float64Array]:
    """Sounds without a voice, by name: samples at 16 kHz."""
    draw, t = np.random.default_rng(0), np.arange(round(seconds * RATE)) / RATE
    white = draw.normal(size=len(t))
    rumble = np.cumsum(white) - np.convolve(np.cumsum(white), np.ones(400) / 400, "same")
    claps = np.convolve(draw.normal(size=len(t)) > 3, np.hanning(200), "same")
    key = draw.normal(size=400) * np.exp(-np.arange(400) / 60)
    short = np.arange(round(0.18 * RATE)) / RATE
    bark = _harmonics(650 - 1200 * short, 8) * np.sin(np.pi * short / 0.18) ** 0.5
    bark += 0.5 * draw.normal(size=len(short)) * np.sin(np.pi * short / 0.18)
    chord = np.sum([_harmonics(np.full(len(t), f), 5) for f in (220.0, 277.0, 330.0)], axis=0)
    gap_s = float(draw.uniform(0.1, 0.2))
    return {
        "silence": 0 * t,
        "hiss": 0.05 * white,
        "clicks": _bursts(np.array([0.8]), np.arange(0.1, seconds, 0.4).tolist(), 0 * t),
        "typing": _bursts(0.2 * key, np.arange(0.2, seconds, gap_s).tolist(), 0 * t),
        "applause": 0.1 * white * (0.3 + np.abs(claps)),
        "thunder": 0.6 * rumble / np.abs(rumble).max() * np.exp(-0.8 * (t % 4)),
        "tone": 0.3 * np.sin(2 * np.pi * 440 * t),
        "siren": 0.05 * _harmonics(700 + 250 * np.sin(2 * np.pi * 0.4 * t), 6),
        "horn": 0.05 * (_harmonics(np.full(len(t), 370.0), 12) * (t % 2 < 1)),
        "chord": 0.06 * chord,
        "bark": _bursts(0.2 * bark, np.arange(0.5, seconds - 0.5, 0.7).tolist(), 0 * t),
    }


def opening_mm(samples: Float64Array, model: str) -> float:
    """The widest opening that a sound gives."""
    sound = Waveform(np.clip(samples, -1, 1).astype(np.float32), RATE)
    motion = animate(sound, model=model, life=0).motion
    return float(measure_mouth(motion)["opening_mm"].max())


def main(argv: Sequence[str] | None = None) -> None:
    assert __doc__ is not None
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("recordings", nargs="*", type=Path, help="further sounds without a voice")
    parser.add_argument("--model", action="append", help="models; articulation and talkers")
    given = parser.parse_args(argv)
    models = given.model or MODELS
    made = [noises(seconds) for seconds in LENGTHS_S]
    table = {name: [each[name] for each in made] for name in made[0]}
    for path in given.recordings:
        table[path.stem] = [read_audio(path, sample_rate=RATE).samples.astype(np.float64)]
    print("| sound |", " | ".join(f"{model}, mm" for model in models), "|")
    print("|---|" + "---|" * len(models))
    for name, sounds in table.items():
        widest = (max(opening_mm(samples, model) for samples in sounds) for model in models)
        print(f"| {name} |", " | ".join(f"{mm:.1f}" for mm in widest), "|")


if __name__ == "__main__":
    main()
