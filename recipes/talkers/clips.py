"""Recordings of talkers as rows: what the network is given, and what the tracked mouth did."""

from __future__ import annotations

from collections import defaultdict
from collections.abc import Iterable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elocute.array_types import Float32Array, Float64Array
from elocute.articulation.contacts_and_rest import SPEECH_AT_LEAST_S, runs
from elocute.audio.loudness import Loudness
from elocute.audio.phones_and_visemes import SILENCE
from elocute.audio.read import read_audio
from elocute.audio.waveform import SPEECH_RATE
from elocute.encoders.phone_encoder import builtin_encoder
from elocute.encoders.protocol import FEATURE_RATE
from elocute.evaluation.tracked_mouths import find_tracked_mouths, read_tracked_mouth
from elocute.files.array_reading import read_npz
from elocute.models.talker_inputs import rule_curves, rule_measures, talker_inputs

FIELDS = ("inner_opening_mean", "lip_width", "protrusion", "jaw")
"""Of a tracked mouth, in the order of `MEASURES`."""
PAUSE_S = 0.4  # a shorter one counts as speech
FRAMES_MIN, STILL = 20, 1e-3
CLOSED_SHARE = 0.12  # of a talker's range of openings, below which lips count as shut
LOWEST, HIGHEST = 3, 90  # percentiles that bound the range
MOST = 4.0  # deviations


@dataclass(eq=False)
class Clip:
    """One recording.

    Attributes
    ----------
    name, talker : str
        Of the recording, and who speaks.
    inputs : (row, input) float32
        As `talker_inputs` gives them.
    speaking : (row,) bool
        Speech and pauses shorter than `PAUSE_S`.
    times_s : (frame,) float64
        Of tracked frames, with the offset of the recording taken out.
    tracked : (frame, measure) float64
        `FIELDS`, in units of the outer eye-corner distance.
    targets : (row, measure + 1) float32
        Deviations from the talker's speech, and 1 where the lips are shut.
    known : (row,) bool
        Where there are targets.
    """

    name: str
    talker: str
    inputs: Float32Array
    speaking: np.ndarray
    times_s: Float64Array
    tracked: Float64Array
    targets: Float32Array
    known: np.ndarray


@dataclass(frozen=True, eq=False)
class TalkerSpeech:
    """Mean and deviation of a talker's measures in speech, and the gap that counts as shut."""

    mean: Float64Array
    deviation: Float64Array
    shut: float


def read_clips(folder: Path, cache: Path, leave_out: Iterable[str] = ()) -> list[Clip]:
    """All usable recordings of a folder, in either layout of `elocute evaluate real`.

    Inputs are computed once and kept in the folder `cache`.
    """
    cache.mkdir(parents=True, exist_ok=True)
    skipped = set(leave_out)
    clips = []
    for found in find_tracked_mouths(folder):
        if found.path.stem in skipped:
            continue
        fields = read_npz(
            found.path,
            max_bytes=16_000_000,
            allowed="a tracked mouth",
            only=frozenset((*FIELDS, "t", "valid")),
        )
        tracked = np.stack([np.asarray(fields[name], float) for name in FIELDS], axis=1)
        seen = (np.asarray(fields["valid"]) > 0) & np.isfinite(tracked).all(axis=1)
        if seen.sum() < FRAMES_MIN or tracked[seen, 0].std() < STILL:
            continue
        inputs = _inputs(found.path, cache)
        times_s = np.asarray(fields["t"], float)[seen] - found.offset_s
        clip = Clip(
            found.path.stem, found.talker, inputs[:, 1:], inputs[:, 0] > 0.5, times_s,
            tracked[seen], np.zeros((0, 0), np.float32), np.zeros(0, np.bool_),
        )  # fmt: skip
        clips.append(clip)
    return clips


def _inputs(path: Path, cache: Path) -> Float32Array:
    """(row, 1 + input): whether somebody speaks, and the inputs."""
    kept = cache / f"{path.stem}.npy"
    if kept.is_file():
        return np.load(kept)
    samples = read_audio(_sound(path), sample_rate=SPEECH_RATE).samples
    phones = builtin_encoder().encode(samples)
    rows = Loudness()
    loudness = np.concatenate([rows.push(samples), rows.flush()])[: len(phones)]
    measures = rule_measures(rule_curves(phones, 0, 0, len(phones)))
    given = talker_inputs(phones, loudness, measures)
    speaking = speech_of(np.exp(phones[:, SILENCE]))
    table = np.concatenate([speaking[:, None], given], axis=1).astype(np.float32)
    np.save(kept, table)
    return table


def _sound(path: Path) -> Path:
    return read_tracked_mouth(path).sound


def speech_of(silence: Float32Array) -> np.ndarray:
    """(row,) speech with its short pauses, without short noises."""
    speaking = silence < 0.5
    for start, stop in runs(~speaking):
        if start and stop < len(speaking) and (stop - start) / FEATURE_RATE < PAUSE_S:
            speaking[start:stop] = True
    for start, stop in runs(speaking):
        if (stop - start) / FEATURE_RATE < SPEECH_AT_LEAST_S:
            speaking[start:stop] = False
    return speaking


def by_talker(clips: Iterable[Clip]) -> dict[str, list[Clip]]:
    """Clips of each talker."""
    grouped: dict[str, list[Clip]] = defaultdict(list)
    for clip in clips:
        grouped[clip.talker].append(clip)
    return grouped


def standardise(clips: list[Clip]) -> dict[str, TalkerSpeech]:
    """Set every clip's targets; returns what each talker's speech is like."""
    found = {}
    for talker, own in by_talker(clips).items():
        sampled = [_sampled(clip, 0.0) for clip in own]
        spoken = [
            rows[known & clip.speaking] for clip, (rows, known) in zip(own, sampled, strict=True)
        ]
        speech = np.concatenate(spoken)
        if len(speech) < FRAMES_MIN:
            speech = np.concatenate([rows[known] for rows, known in sampled])
        low, high = np.percentile(speech[:, 0], [LOWEST, HIGHEST])
        shut = low + CLOSED_SHARE * (high - low)
        found[talker] = TalkerSpeech(speech.mean(axis=0), speech.std(axis=0) + 1e-6, float(shut))
        for clip in own:
            set_targets(clip, found[talker], 0.0)
    return found


def set_targets(clip: Clip, speech: TalkerSpeech, late_s: float) -> None:
    """Targets of a clip whose mouth is that much later than its offset says."""
    rows, clip.known = _sampled(clip, late_s)
    deviations = np.clip((rows - speech.mean) / speech.deviation, -MOST, MOST)
    padded = np.pad(rows[:, 0], 1, mode="edge")
    nearby = np.minimum(np.minimum(padded[:-2], padded[1:-1]), padded[2:])
    shut = nearby < speech.shut
    clip.targets = np.concatenate([deviations, shut[:, None]], axis=1).astype(np.float32)


def _sampled(clip: Clip, late_s: float) -> tuple[Float64Array, np.ndarray]:
    """(row, measure) of the tracked mouth, and (row,) where it was tracked."""
    times = np.arange(len(clip.inputs)) / FEATURE_RATE
    moments = clip.times_s - late_s
    columns = [np.interp(times, moments, column) for column in clip.tracked.T]
    return np.stack(columns, axis=1), (times >= moments[0] - 0.01) & (times <= moments[-1] + 0.01)
