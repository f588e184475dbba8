"""Lip closures with and without a known text: of synthetic voices with exact phone times, and
against the tracked lips of a real talker.

    python -m benchmarks.known_text
    python -m benchmarks.known_text --data ../shared/data
    python -m benchmarks.known_text --data ../shared/data --refusals

The synthetic voices are flite's and festival's; the pronunciations come from espeak-ng, so what the
text says and what the voice says differ as they do for people. The shipped encoder was trained on
these voices, on other sentences. The talker is speaker 1 of GRID, every ninth of the clips on which
nothing was tuned. Refusals are of natural readings, each with its own text and with another's.
"""

from __future__ import annotations

import argparse
import csv
import os
import random
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

for variable in ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS"):
    os.environ[variable] = "1"

import numpy as np

from elocute.animation import Animation, animate
from elocute.array_types import FloatArray
from elocute.audio.read import read_audio
from elocute.audio.waveform import SPEECH_RATE, Waveform
from elocute.encoders.phone_encoder import builtin_encoder
from elocute.encoders.phones_and_visemes import BILABIALS
from elocute.errors import AlignmentError
from elocute.evaluation.lip_closures import CLOSED_MM
from elocute.evaluation.tracked_mouth_scores import (
    ALL,
    MeasuredMouth,
    group_score,
    heard_speech,
    measure_tracked_mouth,
)
from elocute.evaluation.tracked_mouths import TrackedMouth, read_tracked_mouth
from elocute.head.builtin import load_builtin_head
from elocute.motion.mouth_measures import TRACKED_CLOSED, measure_mouth
from elocute.speech.text.transcript import Transcript, transcribe
from recipes.encoder.synthesise import FESTIVAL_VOICES, FLITE_VOICES, Espeak, Phones, utterance

FPS = 60.0
MODEL = "articulation"  # whose contacts the tables count
PAD_S = 0.25
NEAR_S = 0.040
RELEASE_WINDOW_S = (-0.12, 0.20)
EVERY = 9
LANGUAGES = {"en": "en-us", "de": "de", "nl": "nl"}
TEXTS = (
    "Bob put the paper map beside my cup.",
    "Maybe Pam will bump into a big brown bear.",
    "The number of people in the photo was small, but happy.",
    "Please remember to pick up bread, butter, and plum jam.",
    "My problem is simple: five empty boxes and a lamp.",
    "Campers climb up the steep mountain before noon.",
    "A rapid bumblebee hopped above the purple poppy.",
    "Stop mumbling and open both of the maps.",
    "Public parks improve the mood of families.",
    "Robert bought a black umbrella for Monday.",
    "Summer term began with a jumble of opinions.",
    "Empty the pump, Bobby, before the pipe bursts.",
)


@dataclass
class Tally:
    """Closures over utterances; timing errors in frames."""

    wanted: int = 0
    met: int = 0
    made: int = 0
    right: int = 0
    starts: list[float] = field(default_factory=list)
    ends: list[float] = field(default_factory=list)

    def line(self, name: str) -> str:
        starts, ends = np.abs(self.starts), np.abs(self.ends)
        return (
            f"{name:24} {self.met / self.wanted:7.3f} {self.right / max(self.made, 1):10.3f}"
            f" {starts.mean():8.2f} {np.percentile(starts, 90):6.2f}"
            f" {ends.mean():8.2f} {np.percentile(ends, 90):6.2f}"
            f" {np.mean(starts <= 1):8.2f} {np.mean(ends <= 1):6.2f}"
        )


def closed_frames(animation: Animation) -> np.ndarray:
    """(frame,) whether the lips touch."""
    return measure_mouth(animation.motion)["opening_mm"] < CLOSED_MM


def runs(closed: np.ndarray) -> list[tuple[int, int]]:
    edges = np.flatnonzero(np.diff(np.concatenate([[0], closed.astype(np.int8), [0]])))
    return list(zip(edges[::2].tolist(), edges[1::2].tolist(), strict=True))


def bilabials(phones: Phones) -> list[tuple[float, float]]:
    """Stretches of p, b and m; those that follow each other are one."""
    found: list[tuple[float, float]] = []
    for start, end, phone in phones:
        if phone not in BILABIALS:
            continue
        if found and start - found[-1][1] < 1e-6:
            found[-1] = (found[-1][0], end)
        else:
            found.append((start, end))
    return found


def score(tally: Tally, made: np.ndarray, exact: np.ndarray, phones: Phones) -> None:
    """Count closures against the phones; time them against the motion of the exact phones."""
    spans, near = bilabials(phones), NEAR_S
    speech = [(start, end) for start, end, phone in phones if phone != "SIL"]
    begin, finish = speech[0][0], speech[-1][1]
    for start, end in spans:
        tally.wanted += 1
        tally.met += bool(made[round(start * FPS) : round(end * FPS) + 1].any())
    for first, stop in runs(made):
        middle = (first + stop - 1) / 2 / FPS
        if not begin - near <= middle <= finish + near:
            continue  # a rest before or after the speech
        tally.made += 1
        tally.right += any(
            first / FPS <= end + near and (stop - 1) / FPS >= start - near for start, end in spans
        )
    for first, stop in runs(exact):
        if first == 0 or stop == len(exact):
            continue
        same = [run for run in runs(made) if run[0] < stop + 6 and run[1] > first - 6]
        same = [run for run in same if run[0] > 0 and run[1] < len(made)]
        if same:
            near_run = min(same, key=lambda run: abs(run[0] + run[1] - first - stop))
            tally.starts.append(near_run[0] - first)
            tally.ends.append(near_run[1] - stop)


def synthetic(texts: Sequence[str]) -> dict[str, dict[str, Tally]]:
    """Tallies of each engine, without and with the text."""
    found: dict[str, dict[str, Tally]] = {}
    espeak = Espeak()
    voices = [("flite", each) for each in FLITE_VOICES]
    voices += [("festival", each) for each in FESTIVAL_VOICES]
    for engine, voice in voices:
        tallies = found.setdefault(engine, {"sound alone": Tally(), "with the text": Tally()})
        for text in texts:
            samples, phones = utterance(espeak, engine, voice, text)
            pad = np.zeros(round(PAD_S * 16000), np.float32)
            sound = Waveform(np.concatenate([pad, samples, pad]).astype(np.float32), 16000)
            phones = [(start + PAD_S, end + PAD_S, phone) for start, end, phone in phones]
            exact = closed_frames(animate(sound, phones=phones, model=MODEL, fps=FPS, life=0))
            for name, said in (("sound alone", None), ("with the text", text)):
                made = closed_frames(animate(sound, text=said, model=MODEL, fps=FPS, life=0))
                score(tallies[name], made, exact, phones)
    return found


def release_s(times: FloatArray, opening: FloatArray, start_s: float) -> float | None:
    """When lips part that close near the start of a word; None where they do not."""
    low, high = (start_s + offset for offset in RELEASE_WINDOW_S)
    inside = np.flatnonzero((times >= low) & (times <= high))
    closed = inside[opening[inside] < TRACKED_CLOSED]
    if not len(closed) or closed[-1] == inside[-1]:
        return None
    return float(times[closed[-1]])


def releases(mouth: TrackedMouth, predicted: FloatArray, duration_s: float) -> list[float | None]:
    """Delay in s of the predicted parting of the lips, for each b, p or m word; None: not met."""
    fine = np.arange(0, duration_s, 1 / 240)
    seen = np.interp(fine, mouth.times_s[mouth.valid], mouth.opening[mouth.valid])
    made = np.interp(fine, np.arange(len(predicted)) / FPS, predicted)
    delays: list[float | None] = []
    for start_s, _, word in mouth.words:
        if word in ("sil", "sp", "") or word[0] not in "bpm":
            continue
        real = release_s(fine, seen, start_s)
        if real is not None:
            ours = release_s(fine, made, start_s)
            delays.append(None if ours is None else ours - real)
    return delays


def talker(folder: Path) -> None:
    """Print what the text is worth against tracked lips."""
    tuned = set((folder / "dev.txt").read_text().split())
    paths = [p for p in sorted((folder / "clips").glob("*.npz")) if p.stem not in tuned][::EVERY]
    eye_mm = 1000 * load_builtin_head().eye_distance_m
    scores: dict[bool, list[MeasuredMouth]] = {False: [], True: []}
    delays: dict[bool, list[float | None]] = {False: [], True: []}
    refused = 0
    for path in paths:
        mouth = read_tracked_mouth(path)
        speaking = heard_speech(mouth.sound)
        text = " ".join(word for _, _, word in mouth.words if word not in ("sil", "sp", ""))
        for with_text in (False, True):
            try:
                animation = animate(
                    mouth.sound, text=text if with_text else None, model=MODEL, fps=FPS, life=0
                )
            except ValueError:
                refused += 1
                animation = animate(mouth.sound, model=MODEL, fps=FPS, life=0)
            measured = measure_mouth(animation.motion)
            found = measure_tracked_mouth(mouth, measured, eye_mm, speaking)
            scores[with_text].append(found)
            opening = measured["opening_mm"] / eye_mm
            delays[with_text] += releases(mouth, opening, animation.motion.duration_s)
    print(f"{len(paths)} clips of a real talker; {refused} texts refused")
    for with_text, name in ((False, "sound alone"), (True, "with the text")):
        mean, met = group_score(ALL, scores[with_text]), delays[with_text]
        late = np.array([each for each in met if each is not None]) * FPS
        off = np.abs(late - np.median(late))
        print(
            f"{name:16} opening r {mean.opening_best_r:.3f} at {mean.opening_lag_s:+.2f} s,"
            f" width r {mean.width_best_r:.3f}, closures {mean.closure_recall:.3f},"
            f" false {mean.false_closure:.3f}; lips part with his at {len(late)} of {len(met)},"
            f" {np.median(late):+.2f} frames late, within {off.mean():.2f} (90 %:"
            f" {np.percentile(off, 90):.2f})"
        )
    real = group_score(ALL, scores[True])
    print(f"himself: closures {real.real_closure_recall:.3f}, false {real.real_false_closure:.3f}")


def refusals(folder: Path, each: int) -> None:
    """Print how many right and wrong texts of natural readings are refused, by their source."""
    rows = list(csv.reader((folder / "transcripts.tsv").open(encoding="utf-8"), delimiter="\t"))
    sources: dict[str, list[list[str]]] = {}
    for row in rows[1:]:
        if len(row[3].split()) >= 4:
            sources.setdefault(row[0].split("/")[1], []).append(row)
    print(f"{'':14} {'right refused':>14} {'wrong refused':>14} {'of wrong, told doubtful':>24}")
    for source, listed in sources.items():
        chosen = random.Random(1).sample(listed, min(each, len(listed)))
        texts = [row[3] for row in chosen]
        refused, doubtful = {True: 0, False: 0}, 0
        for index, row in enumerate(chosen):
            sound = read_audio(folder.parent / row[0])
            heard = builtin_encoder().encode(sound.resample(SPEECH_RATE).samples)
            language = LANGUAGES[row[2]]
            for right in (True, False):
                text = texts[index] if right else texts[(index + 1) % len(texts)]
                try:
                    found = transcribe(Transcript.of_text(text, language), heard, sound.duration_s)
                    doubtful += bool(found.notes) and not right
                except AlignmentError:
                    refused[right] += 1
        print(
            f"{source:14} {refused[True]:>10}/{len(chosen)} {refused[False]:>10}/{len(chosen)}"
            f" {doubtful:>20}"
        )


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--data", type=Path, help="folder that holds grid_s1: the real talker")
    parser.add_argument("--texts", type=int, default=len(TEXTS), help="sentences of each voice")
    parser.add_argument("--refusals", action="store_true", help="of texts beside recordings")
    parser.add_argument("--each", type=int, default=12, help="recordings of each source")
    arguments = parser.parse_args()
    if arguments.refusals:
        refusals(arguments.data / "speech", arguments.each)
        return
    if arguments.data is not None:
        talker(arguments.data / "grid_s1")
        return
    print(
        f"{'':24} {'recall':>7} {'precision':>10} {'start':>8} {'90 %':>6} {'end':>8}"
        f" {'90 %':>6} {'start<=1':>8} {'end<=1':>6}   (frames at {FPS:g} per second)"
    )
    for engine, tallies in synthetic(TEXTS[: arguments.texts]).items():
        for name, tally in tallies.items():
            print(tally.line(f"{engine}: {name}") + f"   {tally.wanted} closures")


if __name__ == "__main__":
    main()
