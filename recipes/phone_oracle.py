"""How much one talker's mouth tells of another's, phone by phone: real talkers and simulated ones.

    python -m recipes.phone_oracle ../shared/data                       real talkers
    python -m recipes.phone_oracle --simulated 8 --strengths 0,0.5,1    people of `RichFace`

A mouth is foretold from phones as the trunk hears them, linearly, with those before and after. A
talker's own table is fitted to one half of the talker's clips and tried on the other half; so is
the table of each other talker, fitted to as much. The second correlation as a share of the first
tells how alike talkers are: what tracking and hearing take away is taken from both. Means differ by
face and are removed. Simulated people are to be drawn with the strengths whose shares come nearest.
"""

from __future__ import annotations

import argparse
import json
import random
from collections import defaultdict
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from elocute.array_types import Float64Array
from elocute.articulation.style import STYLES
from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.encoders.phone_encoder import builtin_encoder
from elocute.encoders.protocol import FEATURE_RATE
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import resolve_identity
from elocute.numerics.resampling import interpolate
from elocute.numerics.smoothing import gaussian_smoothed
from elocute.speech.text.known_phones import posteriors_from_phones
from recipes.corpus.sentences import candidate
from recipes.encoder.store import LABEL_RATE, RATE
from recipes.encoder.synthesise import Phones
from recipes.rich_faces.rich_face import FaceRichness, RichFace, RichTake
from recipes.talker_spread import FLAWS, FPS, GRID_CLIPS

MEASURES = ("opening", "width", "protrusion", "jaw")
TRACKED = ("inner_opening_mean", "lip_width", "protrusion", "jaw")
SEEN_S = 0.03  # over which posteriors are smoothed
AROUND_S = (-0.12, -0.06, 0.0, 0.06, 0.12)
RIDGE = 3e-3
FRAMES_MIN = 600  # of a talker, half of which a table is fitted to
FRAMES_MOST = 1200
Clip = tuple[Float64Array, Float64Array]  # (frame, feature), (frame, measure)
Said = list[list[tuple[Waveform, Phones, Float64Array]]]  # sentences of each person


def features(sound: Waveform, times: Float64Array) -> Float64Array:
    """(time, feature) at times in s: posteriors of the trunk's phones, before, at and after."""
    rows = np.exp(builtin_encoder().encode(sound.samples).astype(np.float64))
    rows = gaussian_smoothed(rows, SEEN_S * FEATURE_RATE)
    at = np.arange(len(rows)) / FEATURE_RATE
    return np.concatenate([interpolate(at, rows, times + d) for d in AROUND_S], axis=1)


def real_talkers(data: Path) -> Iterator[list[Clip]]:
    """Clips of each talker who has enough of them."""
    room, by_speaker = data / "talkers" / "train", defaultdict[str, list[tuple[Path, float]]](list)
    for clip in json.loads((room / "manifest.json").read_text(encoding="utf-8"))["clips"]:
        if clip["speaker"].startswith("ar_") and not FLAWS & set(clip.get("flags", ())):
            by_speaker[clip["speaker"]].append((room / clip["npz"], clip["offset_s"] or 0.0))
    grid = sorted((data / "grid_s1" / "clips").glob("*.npz"))[:GRID_CLIPS]
    by_speaker["grid"] = [(path, 0.0) for path in grid]
    for paths in by_speaker.values():
        clips: list[Clip] = []
        for path, offset_s in paths:
            if sum(len(rows) for rows, _ in clips) >= FRAMES_MOST:
                break
            clips += _tracked(path, offset_s)
        if sum(len(rows) for rows, _ in clips) >= FRAMES_MIN:
            yield clips


def _tracked(path: Path, offset_s: float) -> Iterator[Clip]:
    with np.load(path) as clip:
        measures = np.stack([clip[name] for name in TRACKED], axis=1).astype(np.float64)
        seen = clip["valid"].astype(bool) & np.isfinite(measures).all(axis=1)
        times = clip["t"].astype(np.float64) - offset_s
    if seen.any():
        sound = read_audio(path.with_suffix(".ogg"), sample_rate=RATE)
        yield features(sound, times[seen]), measures[seen]


def simulated_talkers(people: int, richness: FaceRichness, said: Said) -> Iterator[list[Clip]]:
    """The same of people drawn from seeds, each of whom says sentences of the person's own."""
    head = load_builtin_head()
    for number in range(people):
        face = resolve_identity(str(number))
        person = RichFace(head, face, STYLES["plain"], richness, seed=number)
        yield [
            (rows, measured(person.take(
                posteriors_from_phones(phones, sound.duration_s, LABEL_RATE),
                LABEL_RATE,
                frame_count=len(rows),
                fps=FPS,
                sound=sound,
                name=str(index),
            )))
            for index, (sound, phones, rows) in enumerate(said[number])
        ]  # fmt: skip


def measured(take: RichTake) -> Float64Array:
    """(frame, measure) of a simulated take, in distances of the eye corners, as trackers do."""
    head, vertices = take.face.head, take.vertices().astype(float)
    eyes = take.face.template[head.landmarks[[36, 45]]]
    vertices /= np.linalg.norm(eyes[1] - eyes[0])
    third = len(head.inner_lip_upper) // 3
    upper, lower = head.inner_lip_upper[third:-third], head.inner_lip_lower[third:-third]
    corners, middle = vertices[:, head.outer_corners], vertices[:, head.landmarks[[51, 57]]]
    return np.stack(
        [
            np.maximum(vertices[:, upper, 1] - vertices[:, lower, 1], 0).mean(axis=1),
            np.linalg.norm(corners[:, 1] - corners[:, 0], axis=1),
            middle[:, :, 2].mean(axis=1) - corners[:, :, 2].mean(axis=1),
            -vertices[:, head.landmarks[8], 1],
        ],
        axis=1,
    )


def sayings(people: int) -> Said:
    """Sound, phones with times and features of sentences, others for each person."""
    from recipes.encoder.synthesise import Espeak

    voice, draw, said = Espeak(), random.Random(1), []
    for _ in range(people):
        sentences, frames = [], 0
        while frames < FRAMES_MOST:
            samples, phones = voice.speak(candidate(draw), "en-us", 165, 50, 50)
            sound = Waveform(np.asarray(samples, np.float32), RATE)
            times = np.arange(round(sound.duration_s * FPS)) / FPS
            sentences.append((sound, phones, features(sound, times)))
            frames += len(times)
        said.append(sentences)
    return said


def shares(talkers: Sequence[list[Clip]]) -> tuple[Float64Array, Float64Array]:
    """(measure,) correlations of talkers' own tables, and those of others as a share of them."""
    fitted, tried = zip(*map(_halves, talkers), strict=True)
    tables = [_table(rows, values) for rows, values in fitted]
    found = np.array(
        [
            [
                [np.corrcoef(p, v)[0, 1] for p, v in zip((rows @ table).T, values.T, strict=True)]
                for table in tables
            ]
            for rows, values in tried
        ]
    )  # fmt: skip  (talker, table, measure)
    same = np.eye(len(tables), dtype=bool)
    own, other = found[same].mean(axis=0), found[~same].mean(axis=0)
    return own, other / own


def _halves(clips: list[Clip]) -> tuple[Clip, Clip]:
    """Every other clip to fit to, and the rest to try on, less the talker's means."""
    halves = []
    mean_x = np.concatenate([rows for rows, _ in clips]).mean(axis=0)
    mean_y = np.concatenate([values for _, values in clips]).mean(axis=0)
    for part in (clips[::2], clips[1::2]):
        rows = np.concatenate([rows for rows, _ in part]) - mean_x
        halves.append((rows, np.concatenate([values for _, values in part]) - mean_y))
    return halves[0], halves[1]


def _table(rows: Float64Array, values: Float64Array) -> Float64Array:
    """(feature, measure) by least squares with a ridge."""
    gram = rows.T @ rows + RIDGE * len(rows) * np.eye(rows.shape[1])
    return np.asarray(np.linalg.solve(gram, rows.T @ values), np.float64)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("data", type=Path, nargs="?", help="folder with talkers and grid_s1")
    parser.add_argument("--simulated", type=int, default=0, help="so many simulated people")
    parser.add_argument("--strengths", default="1", help="of own_shapes and habits, all pairs")
    choice = parser.parse_args()
    print(f"| | talkers | own: {', '.join(MEASURES)} | other's share of own |\n|---|---|---|---|")
    if choice.data:
        _tell("real", list(real_talkers(choice.data)))
    said = sayings(choice.simulated)
    strengths = [float(value) for value in choice.strengths.split(",")] if said else []
    for own_shapes in strengths:
        for habits in strengths:
            richness = FaceRichness(own_shapes=own_shapes, habits=habits)
            people = list(simulated_talkers(choice.simulated, richness, said))
            _tell(f"own_shapes {own_shapes:g}, habits {habits:g}", people)


def _tell(name: str, talkers: list[list[Clip]]) -> None:
    own, share = (" ".join(f"{value:.3f}" for value in each) for each in shares(talkers))
    print(f"| {name} | {len(talkers)} | {own} | {share} |", flush=True)


if __name__ == "__main__":
    main()
