"""Bake what is usual among tracked people, which simulated raters compare faces with.

    python -m recipes.study_raters.people_seen ../shared/data

DATA has `grid_s1` (one man, 3 s sentences; GRID, CC BY 4.0) and `talkers/train` (television news,
33 talkers). GRID's development clips, every fourth news talker and `talkers/dev` are left out, for
`recipes.study_raters.against_people`. What is written is sixty means, spreads and one weight, and
nobody's motion.
"""

from __future__ import annotations

import argparse
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

import elocute
from elocute.array_types import Float64Array
from elocute.audio.read import read_audio
from elocute.audio.waveform import SPEECH_RATE, Waveform
from elocute.evaluation.tracked_mouths import (
    TrackedClip,
    find_tracked_mouths,
    read_tracked_mouth,
)
from elocute.files.array_reading import read_npz
from elocute.files.reading import FileKind
from elocute.head.builtin import load_builtin_head
from elocute.motion.mouth_measures import TRACKED_RESTING, tracked_opening_share
from elocute.speech.times.labels import Label
from recipes.study_raters import seen_mouths
from recipes.study_raters.raters import Weights, timing_loss
from recipes.study_raters.seen_mouths import HeardSound, PeopleSeen, Seen, SeenMouth

NOTICED_EARLY_S, NOTICED_LATE_S = -0.045, 0.125
"""Sound against picture; ITU-R BT.1359-1 (1998): where it is noticed."""
NOTICED = 0.75
"""What is noticed by half is chosen right by these, the others guessing."""
GRID_EVERY, TALKER_CLIPS, HELD_OUT_EVERY = 4, 12, 4
JITTER_MAX, EYES_MIN_PX = 0.005, 60.0
SMOOTH_S, AHEAD_S = (0.03, 0.05, 0.07), (-0.04, -0.02, 0.0, 0.02, 0.04)
RIDGE = 20.0
FIELDS_FILE = FileKind("tracked fields", 50_000_000)
OUTPUT = Path(__file__).with_name("people_seen.json")


@dataclass(frozen=True)
class Watched:
    """A tracked clip: what is seen, heard, and whose it is."""

    name: str
    talker: str
    mouth: SeenMouth
    sound: Waveform
    phones: Sequence[Label]


def watched(clip: TrackedClip) -> Watched | None:
    """A clip, its own offset between sound and picture taken out; None where the face was lost."""
    recorded = read_tracked_mouth(clip)
    if not recorded.valid.all():
        return None
    fields = read_npz(clip.path, FIELDS_FILE, only=frozenset(("eye_open", "pose_deg")))
    turns, lids = np.asarray(fields["pose_deg"], float), np.asarray(fields["eye_open"], float)
    if not (np.isfinite(turns).all() and np.isfinite(lids).all()):
        return None
    mouth = SeenMouth(
        opening_mm=opening_of(recorded.opening),
        fps=float(1 / np.median(np.diff(recorded.times_s))),
        start_s=float(recorded.times_s[0]) - recorded.offset_s,
        turns_deg=turns,
        lids=lids / np.percentile(lids, 85),
    )
    sound = read_audio(recorded.sound, sample_rate=SPEECH_RATE)
    return Watched(recorded.name, recorded.talker, mouth, sound, elocute.find_phones(sound).phones)


def opening_of(tracked: Float64Array) -> Float64Array:
    """(frame,) mm of the built-in head, as a captured mouth would be open."""
    eyes_mm = 1000 * load_builtin_head().eye_distance_m
    share = tracked_opening_share(tracked)
    return eyes_mm * share * np.maximum(tracked - TRACKED_RESTING, 0)


def teaching_clips(data: Path) -> Iterator[TrackedClip]:
    """Clips that may teach: GRID's without its development clips, and those of news talkers."""
    held_out = set((data / "grid_s1/dev.txt").read_text().split())
    grid = [
        each
        for each in find_tracked_mouths(data / "grid_s1/clips")
        if each.path.stem not in held_out
    ]
    yield from grid[::GRID_EVERY]
    yield from news_clips(data, held_out=False)


def news_clips(data: Path, *, held_out: bool) -> Iterator[TrackedClip]:
    """Clips of news talkers who are seen well: of those who may teach, or of the others."""
    folder = data / "talkers/train"
    manifest = json.loads((folder / "manifest.json").read_text())["clips"]
    clear = {
        each["id"]
        for each in manifest
        if each["id"].startswith("ar_")
        and each["jitter"] < JITTER_MAX
        and each["eye_px"] > EYES_MIN_PX
    }
    clips = [each for each in find_tracked_mouths(folder) if each.path.stem in clear]
    others = set(sorted({each.talker for each in clips})[::HELD_OUT_EVERY])
    taken: dict[str, int] = {}
    for clip in clips:
        taken[clip.talker] = taken.get(clip.talker, 0) + 1
        if (clip.talker in others) is held_out and taken[clip.talker] <= TALKER_CLIPS:
            yield clip


def learn_expectation(clips: Sequence[Watched]) -> PeopleSeen:
    """How far each phone opens people's mouths, by the smoothing and lead that fit best."""
    best: tuple[float, PeopleSeen] | None = None
    for smooth_s in SMOOTH_S:
        for ahead_s in AHEAD_S:
            found = _opening_by_phone(clips, smooth_s, ahead_s)
            heard = [seen_mouths.hear(each.sound, each.phones, found) for each in clips]
            fits = [_fit(each, told) for each, told in zip(clips, heard, strict=True)]
            if best is None or np.mean(fits) > best[0]:
                best = float(np.mean(fits)), found
    assert best is not None
    print(f"fit {best[0]:.3f} at {best[1].smooth_s} {best[1].ahead_s}")
    return best[1]


def _fit(each: Watched, heard: HeardSound) -> float:
    return float(seen_mouths.fit_at(each.mouth, heard, np.zeros(1))[0])


def _opening_by_phone(clips: Sequence[Watched], smooth_s: float, ahead_s: float) -> PeopleSeen:
    names = seen_mouths.phone_names()
    inputs, wanted = [], []
    for each in clips:
        named, loud = seen_mouths.expectation_inputs(each.sound, each.phones, smooth_s, ahead_s)
        rows = np.round(each.mouth.times_s * seen_mouths.EXPECTED_RATE).astype(int)
        inside = (rows >= 0) & (rows < len(named))
        inputs.append(np.column_stack([named, loud])[rows[inside]])
        # A talker who opens wide says nothing of phones.
        wanted.append(each.mouth.opening_mm[inside])
    x, y = np.concatenate(inputs), np.concatenate(wanted)
    middle = float(y.mean())
    found = np.linalg.solve(x.T @ x + RIDGE * np.eye(x.shape[1]), x.T @ (y - middle))
    opening = {
        name: round(float(value) + middle, 2) for name, value in zip(names, found[:-1], strict=True)
    }
    return PeopleSeen(opening, round(float(found[-1]), 2), smooth_s, ahead_s, {}, 0.0, 1.0)


def usual_of(seen: Sequence[Seen]) -> dict[str, tuple[float, float]]:
    """Middle and spread of each measure that is compared."""
    rows = [seen_mouths.compared(each) for each in seen]
    found = {}
    for name in rows[0]:
        values = np.array([row[name] for row in rows])
        low, middle, high = np.nanpercentile(values, [15.87, 50, 84.13])
        found[name] = (round(float(middle), 3), round(float(high - low) / 2, 3))
    return found


def sync_weight(clips: Sequence[Watched], people: PeopleSeen) -> float:
    """Logits for a loss of 1: a delay that half notice is on average chosen against by `NOTICED`.

    Single clips scatter for reasons that are the measure's and not people's, so it is the mean
    loss that is set.
    """
    apart = []
    for each in clips:
        heard = seen_mouths.hear(each.sound, each.phones, people)
        own = timing_loss(seen_mouths.look(each.mouth, heard), people)
        for late_s in (NOTICED_EARLY_S, NOTICED_LATE_S):
            moved = seen_mouths.look(shifted(each.mouth, late_s), heard)
            apart.append(timing_loss(moved, people) - own)
    print(f"loss {np.mean(apart[::2]):.3f} early, {np.mean(apart[1::2]):.3f} late")
    return round(float(np.log(NOTICED / (1 - NOTICED)) / np.mean(apart)), 2)


def shifted(mouth: SeenMouth, late_s: float) -> SeenMouth:
    """The same picture with its sound later."""
    return replace(mouth, start_s=mouth.start_s - late_s)


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("data", type=Path, help="the data folder")
    given = parser.parse_args()
    clips = [found for each in teaching_clips(given.data) if (found := watched(each)) is not None]
    print(f"{len(clips)} clips of {len({each.talker for each in clips})} talkers")
    people = learn_expectation(clips)
    seen = [
        seen_mouths.look(each.mouth, seen_mouths.hear(each.sound, each.phones, people))
        for each in clips
    ]
    least = round(float(np.percentile([each.fit for each in seen], 25)), 3)
    people = replace(people, usual=usual_of(seen), fit_least=least)
    people = replace(people, sync_weight=sync_weight(clips, people))
    for name in ("fit", "best_fit", "late_s", "missed_seals", "false_seals"):
        values = np.array([getattr(each, name) for each in seen])
        print(name, np.round(np.nanpercentile(values, [5, 25, 50, 75, 95]), 3))
    stored = {
        "made_from": "GRID speaker 1 (CC BY 4.0), Arabic television news; recipes/study_raters",
        **people.__dict__,
    }
    OUTPUT.write_text(json.dumps(stored, indent=1) + "\n")
    print(f"{OUTPUT}: sync weight {people.sync_weight}, least fit {people.fit_least}, {Weights()}")


if __name__ == "__main__":
    main()
