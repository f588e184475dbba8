"""Simulated raters against what is known of people.

    python -m recipes.study_raters.against_people ../shared/data

People whose mouths were tracked in video, and who taught the raters nothing (GRID's development
clips are of a man who did, by other sentences): how often raters take a mouth as it was over the
same one shown early or late, with another sentence, or damaged; and which of the models they take.
`chosen` is the mean of what raters with these strengths would choose, `ordered` how often the
strengths are in the right order.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import elocute
from elocute.array_types import Float64Array
from elocute.audio.waveform import Waveform
from elocute.evaluation.tracked_mouths import TrackedClip, find_tracked_mouths
from elocute.motion.mouth_measures import measure_mouth
from recipes.study_raters.people_seen import Watched, news_clips, shifted, watched
from recipes.study_raters.raters import strength
from recipes.study_raters.seen_mouths import HeardSound, SeenMouth, hear, look

PIECE_S = 3.0
DELAYS_MS = (-250, -185, -125, -90, -45, 45, 90, 125, 185, 250)
MODELS = ("articulation", "voca", "crnn", "talkers")
MODEL_CLIPS = 12


@dataclass(frozen=True)
class Take:
    """A piece of a tracked clip, its sound as raters hear it, and what they make of it."""

    mouth: SeenMouth
    sound: Waveform
    heard: HeardSound
    own: float


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("data", type=Path, help="the data folder")
    given = parser.parse_args()
    sources = {name: _takes(clips) for name, clips in _sources(given.data).items()}
    print("| | clips | " + " | ".join(f"{each:+d} ms" for each in DELAYS_MS) + " |")
    print("|---|---|" + "---|" * len(DELAYS_MS))
    for name, takes in sources.items():
        cells = [_late(takes, ms) for ms in DELAYS_MS]
        print(f"| {name} | {len(takes)} | " + " | ".join(cells) + " |", flush=True)
    print(
        "\n| | other sentence | frozen | half as open | 1.6 times | blurred by 80 ms | no seals |"
    )
    print("|---|---|---|---|---|---|---|")
    for name, takes in sources.items():
        cells = [_others(takes), *(_share(takes, damage) for damage in DAMAGES.values())]
        print(f"| {name} | " + " | ".join(cells) + " |", flush=True)
    print(
        "\n| | clips | "
        + " | ".join(f"{each} over {MODELS[0]}" for each in MODELS[1:])
        + " | "
        + " | ".join(f"own over {each}" for each in MODELS)
        + " |"
    )
    print("|---|---|" + "---|" * (2 * len(MODELS) - 1))
    for name, takes in sources.items():
        some = takes[:: max(1, len(takes) // MODEL_CLIPS)][:MODEL_CLIPS]
        made = {model: np.array([_model(model, take) for take in some]) for model in MODELS}
        own = np.array([take.own for take in some])
        cells = [_told(made[model] - made[MODELS[0]]) for model in MODELS[1:]]
        cells += [_told(own - made[model]) for model in MODELS]
        print(f"| {name} | {len(some)} | " + " | ".join(cells) + " |", flush=True)


def _sources(data: Path) -> dict[str, list[TrackedClip]]:
    held = sorted((data / "grid_s1/dev.txt").read_text().split())
    dev = find_tracked_mouths(data / "talkers/dev")
    manifest = json.loads((data / "talkers/dev/manifest.json").read_text())["clips"]
    found = {
        "GRID, other sentences": find_tracked_mouths(data / "grid_s1/clips", held),
        "news, other talkers": list(news_clips(data, held_out=True)),
    }
    for start, name in (("edtalk", "a man, English"), ("romajaku", "syllables, Polish")):
        ids = {each["id"] for each in manifest if each["id"].startswith(start)}
        found[name] = [each for each in dev if each.path.stem in ids]
    return found


def _takes(clips: Sequence[TrackedClip]) -> list[Take]:
    found = []
    for clip in clips:
        whole = watched(clip)
        if whole is not None:
            found += [_take(piece) for piece in _pieces(whole)]
    return found


def _pieces(whole: Watched) -> list[Watched]:
    """Stretches of `PIECE_S` of a long clip; a short one as it is."""
    count = int(whole.sound.duration_s // PIECE_S)
    if count < 2:
        return [whole]
    mouth, rate = whole.mouth, whole.sound.sample_rate
    pieces = []
    for at in range(count):
        start, end = at * PIECE_S, (at + 1) * PIECE_S
        kept = (mouth.times_s >= start) & (mouth.times_s < end)
        if kept.sum() < 10:
            continue
        sound = Waveform(whole.sound.samples[round(start * rate) : round(end * rate)], rate)
        phones = [
            (max(0.0, a - start), min(b, end) - start, phone)
            for a, b, phone in whole.phones
            if a < end and b > start
        ]
        assert mouth.turns_deg is not None and mouth.lids is not None
        part = replace(
            mouth,
            opening_mm=mouth.opening_mm[kept],
            start_s=float(mouth.times_s[kept][0]) - start,
            turns_deg=mouth.turns_deg[kept],
            lids=mouth.lids[kept],
        )
        pieces.append(replace(whole, mouth=part, sound=sound, phones=phones))
    return pieces


def _take(piece: Watched) -> Take:
    heard = hear(piece.sound, piece.phones)
    # Of the mouth alone: models are not asked for heads and lids here.
    mouth = replace(piece.mouth, turns_deg=None, lids=None)
    return Take(mouth, piece.sound, heard, _strength(mouth, heard))


def _strength(mouth: SeenMouth, heard: HeardSound) -> float:
    return strength(look(mouth, heard))


def _share(takes: Sequence[Take], changed: Callable[[Take], SeenMouth]) -> str:
    return _told(np.array([take.own - _strength(changed(take), take.heard) for take in takes]))


def _late(takes: Sequence[Take], late_ms: float) -> str:
    return _share(takes, lambda take: shifted(take.mouth, late_ms / 1000))


def _told(apart: Float64Array) -> str:
    """What is chosen and how often the order is right, %."""
    chosen = np.mean(0.5 * (1 + np.tanh(apart / 2)))
    ordered = np.mean(apart > 0) + 0.5 * np.mean(apart == 0)
    return f"{100 * chosen:.0f} ({100 * ordered:.0f})"


def _others(takes: Sequence[Take]) -> str:
    apart = []
    for take, other in zip(takes, [*takes[1:], takes[0]], strict=True):
        count = len(take.mouth.opening_mm)
        shown = replace(take.mouth, opening_mm=np.resize(other.mouth.opening_mm, count))
        apart.append(take.own - _strength(shown, take.heard))
    return _told(np.array(apart))


def _opened(take: Take, opening_mm: Float64Array) -> SeenMouth:
    return replace(take.mouth, opening_mm=opening_mm)


def _blurred(take: Take) -> SeenMouth:
    sd = 0.08 * take.mouth.fps
    reach = round(3 * sd)
    kernel = np.exp(-0.5 * np.square(np.arange(-reach, reach + 1) / sd))
    padded = np.pad(take.mouth.opening_mm, reach, mode="edge")
    blurred = np.convolve(padded, kernel / kernel.sum(), "valid")
    return _opened(take, blurred.astype(np.float64))


DAMAGES: dict[str, Callable[[Take], SeenMouth]] = {
    "frozen": lambda take: _opened(
        take, np.full_like(take.mouth.opening_mm, take.mouth.opening_mm.mean())
    ),
    "half as open": lambda take: _opened(take, 0.5 * take.mouth.opening_mm),
    "1.6 times": lambda take: _opened(take, 1.6 * take.mouth.opening_mm),
    "blurred by 80 ms": _blurred,
    "no seals": lambda take: _opened(take, np.maximum(take.mouth.opening_mm, 1.5)),
}


def _model(name: str, take: Take) -> float:
    """The mouth of a model to the same sound, at the same moments."""
    motion = elocute.animate(take.sound, model=name, life=0, fps=take.mouth.fps).motion
    opening = measure_mouth(motion)["opening_mm"].astype(np.float64)
    shown = np.interp(take.mouth.times_s, motion.times_s, opening)
    return _strength(_opened(take, shown), take.heard)


if __name__ == "__main__":
    main()
