"""Tracked mouth curves of one talker's words, their phones by forced alignment of his sound.

The paper aligns facial actions of MMI; here the same words of the GRID sentences of
`../shared/data/grid_s1`, 25 frames a second, cut at the word times with a little around.
"""

from __future__ import annotations

import json
from collections import defaultdict
from pathlib import Path

import numpy as np

from elocute.evaluation.timed_recordings import TimedRecording
from recipes.encoder.natural import PAD_S, EnglishAligner, read

CURVES = (
    "inner_opening_mean",
    "opening",
    "lip_width",
    "inner_width",
    "outer_height",
    "jaw",
    "lower_lip",
    "upper_lip",
    "protrusion",
)
WORDS = (
    "please",
    "again",
    "seven",
    "white",
    "green",
    "place",
    "with",
    "blue",
    "soon",
    "four",
    "five",
    "nine",
    "three",
    "now",
    "red",
    "zero",
    "eight",
    "six",
)
AROUND_S = 0.08
TAKES = 10


def visual_words(data: Path) -> dict[str, list[TimedRecording]]:
    """Takes of each word; view (frame, curve), each of mean 0 and deviation 1."""
    found: dict[str, list[TimedRecording]] = defaultdict(list)
    aligner = EnglishAligner()
    for path in sorted((data / "grid_s1" / "clips").glob("*.npz")):
        if min(len(found[word]) for word in WORDS) >= TAKES:
            break
        with np.load(path, allow_pickle=False) as tracked:
            words = json.loads(str(tracked["words"]))
            wanted = [w for w in words if w[2] in WORDS and len(found[w[2]]) < TAKES]
            if not wanted or not tracked["valid"].all():
                continue
            curves = np.stack([tracked[name] for name in CURVES], axis=1).astype(np.float32)
            fps = float(tracked["fps"])
        spoken = [w[2] for w in words if w[2] not in ("sil", "sp")]
        phones = aligner.align(read(path.with_suffix(".ogg")), " ".join(spoken)) or []
        phones = [(a - PAD_S, b - PAD_S, p) for a, b, p in phones if p != "SIL"]
        for start, end, word in wanted:
            take = _cut(path.stem, curves, fps, phones, (start, end))
            if take:
                found[word].append(take)
    return found


def _cut(
    name: str,
    curves: np.ndarray,
    fps: float,
    phones: list[tuple[float, float, str]],
    span: tuple[float, float],
) -> TimedRecording | None:
    first = max(0, int(np.floor((span[0] - AROUND_S) * fps)))
    view = curves[first : int(np.ceil((span[1] + AROUND_S) * fps)) + 1]
    inside = [p for p in phones if span[0] <= (p[0] + p[1]) / 2 < span[1]]
    if len(inside) < 2 or len(view) < 4 or not np.isfinite(view).all():
        return None
    shift = first / fps
    parts = tuple((max(0.0, a - shift), b - shift, phone) for a, b, phone in inside)
    view = (view - view.mean(axis=0)) / np.maximum(view.std(axis=0), 1e-6)
    slopes = np.gradient(view, axis=0)
    return TimedRecording(
        name, np.concatenate([view, slopes], axis=1).astype(np.float32), parts, rate=fps
    )
