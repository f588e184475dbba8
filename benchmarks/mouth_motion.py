"""How an animated mouth moves, beside the tracked mouths of people who say the same.

    python -m benchmarks.mouth_motion DATA/grid_s1/clips --names DATA/grid_s1/dev.txt
    python -m benchmarks.mouth_motion DATA/talkers/dev --talker edtalk_pose2
    python -m benchmarks.mouth_motion DATA/talkers/dev --talker edtalk_pose2 --lookahead 0.3

All in mm on the built-in head: what people do is scaled by the distance of the outer eye corners.
Rest is the median of frames in which the ear hears nobody. Correlations are of each recording, at
the best of lags up to 0.12 s.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elocute.animation import animate
from elocute.array_types import Float64Array, FloatArray
from elocute.audio.read import read_audio
from elocute.audio.waveform import SPEECH_RATE, Waveform
from elocute.encoders.phones_and_visemes import PHONES, SILENCE
from elocute.encoders.protocol import FEATURE_RATE
from elocute.evaluation.tracked_mouths import TrackedClip, find_tracked_mouths, read_tracked_mouth
from elocute.files.array_reading import read_npz
from elocute.files.reading import FileKind
from elocute.head.builtin import load_builtin_head
from elocute.models.feature_extraction import extract_features
from elocute.models.registry import open_model
from elocute.models.streaming import stream
from elocute.motion.curves import Curves, motion_from_curves
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import measure_as_tracked
from elocute.numerics.correlation import pearson

MOUTH_FILE = FileKind("a tracked mouth", 16_000_000)
FIELDS = ("inner_opening_mean", "lip_width", "protrusion", "jaw", "upper_lip", "lower_lip")
SHOWN = ("opening", "width", "protrusion", "jaw", "upper lip", "lower lip")
OPENING, JAW = 0, 3
LABIODENTALS, SURELY = [PHONES.index("F"), PHONES.index("V")], 0.6
LAGS_S = np.arange(-0.12, 0.121, 0.02)
SHUT_MM, OURS_SHUT_MM = 1.8, 0.1  # trackers see a gap between lips that touch
TOUCHING_MM = 0.9  # that they see at least
BEFORE_S = (0.4, 0.2)  # from and to where before the first sound a breath is looked for
TRACKED_LEAST, REST_LEAST = 0.9, 5  # share of frames, and frames
FPS = 60
Animated = Callable[[Waveform], Motion]


@dataclass(frozen=True, eq=False)
class Recording:
    """Frames of speech of one recording, less rest; the gap as it is.

    Attributes
    ----------
    ours, theirs : (frame, 6) float64
        Of the animated head and of the person, mm.
    r, told_r : (6,) float64
        Best correlation of each measure, over all frames that were tracked: of the animated head,
        and of what the trunk tells before anything moves.
    bitten_mm : (frame,) float64
        Gap of our lips in f and v.
    chin_speeds : (pair, 2) float64
        Ours and theirs, mm/s.
    before_mm : (2,) float64
        Gap of our lips and of theirs just before the first sound; not a number where the recording
        begins too late.
    """

    ours: Float64Array
    theirs: Float64Array
    r: Float64Array
    told_r: Float64Array
    bitten_mm: Float64Array
    chin_speeds: Float64Array
    before_mm: Float64Array


def compared(
    found: TrackedClip, model: str | Animated, lookahead: float | None = None
) -> Recording | None:
    """One recording beside the animated head; None where a tenth of it was not tracked.

    model: its name, or what makes a motion of a sound. lookahead: of a live stream, s; None for
    `animate`.
    """
    fields = read_npz(found.path, MOUTH_FILE, only=frozenset((*FIELDS, "t", "valid")))
    tracked = np.stack([np.asarray(fields[name], float) for name in FIELDS], axis=1)
    seen = np.isfinite(tracked).all(axis=1) & (np.asarray(fields["valid"]) > 0)
    if seen.mean() < TRACKED_LEAST:
        return None
    times_s = np.asarray(fields["t"], float) - found.offset_s
    sound = read_audio(read_tracked_mouth(found).sound, sample_rate=SPEECH_RATE)
    if not isinstance(model, str):
        motion = model(sound)
    elif lookahead is None:
        motion = animate(sound, model=model, fps=FPS, life=0).motion
    else:
        motion = streamed(sound, model, lookahead)
    mine, clock = (
        measure_as_tracked(motion).values.astype(float),
        np.arange(motion.frame_count) / FPS,
    )
    still = np.zeros((1, motion.weights.shape[1]), np.float32)
    at_rest = measure_as_tracked(Motion(motion.head, still, FPS)).values[0].astype(float)
    theirs = tracked * 1000 * motion.head.eye_distance_m
    lagged = _lagged(times_s, clock, mine)
    speech, _ = extract_features(open_model("talkers"), sound)
    rows = np.arange(len(speech.features.values)) / FEATURE_RATE
    told = _lagged(times_s, rows, speech.features.values[:, : len(FIELDS)])
    r, told_r = (
        [max(pearson(x[seen, k], theirs[seen, k]) for x in each) for k in range(len(FIELDS))]
        for each in (lagged, told)
    )
    assert speech.phones is not None
    heard = np.exp(speech.phones.values)
    silence = heard[:, SILENCE]
    bitten = np.interp(clock, rows, heard[:, LABIODENTALS].sum(axis=1)) > SURELY
    first_s = rows[np.argmax(silence < 0.5)]
    begin_s, end_s = first_s - BEFORE_S[0], first_s - BEFORE_S[1]
    before = seen & (times_s >= begin_s) & (times_s <= end_s) & (begin_s >= 0)
    ours_at_once = lagged[len(LAGS_S) // 2]
    gaps = np.stack([ours_at_once[:, OPENING], theirs[:, OPENING] - TOUCHING_MM], axis=1)
    before_mm = np.maximum(gaps[before], 0).mean(axis=0) if before.any() else np.full(2, np.nan)
    quiet = np.interp(times_s, np.arange(len(silence)) / FEATURE_RATE, silence) > 0.5
    resting = seen & quiet
    if resting.sum() < REST_LEAST:
        resting = seen & (tracked[:, JAW] <= np.percentile(tracked[seen, JAW], 10))
    rest = np.median(theirs[resting], axis=0)
    rest[OPENING] = at_rest[OPENING] = 0
    spoken = seen & ~quiet
    pairs = spoken[1:] & spoken[:-1]
    speeds = [np.abs(np.diff(each[:, JAW]))[pairs] for each in (ours_at_once, theirs)]
    return Recording(
        (ours_at_once - at_rest)[spoken],
        (theirs - rest)[spoken],
        np.array(r),
        np.array(told_r),
        mine[bitten, OPENING],
        np.stack(speeds, axis=1) / np.median(np.diff(times_s)),
        before_mm,
    )


def streamed(sound: Waveform, model: str, lookahead: float) -> Motion:
    """The motion of a live stream of blocks of 20 ms."""
    live = stream(sound.sample_rate, model, FPS, lookahead=lookahead, life=0)
    size = sound.sample_rate // 50
    blocks = [sound.samples[at : at + size] for at in range(0, len(sound.samples), size)]
    frames = [*(frame for block in blocks for frame in live.push(block)), *live.flush()]
    values = np.stack([frame.values for frame in frames])
    return motion_from_curves(load_builtin_head(), Curves(values, frames[0].names, FPS))


def _lagged(times_s: Float64Array, clock: Float64Array, values: FloatArray) -> list[Float64Array]:
    """Values at the tracked moments, for each lag."""
    return [
        np.stack([np.interp(times_s - lag, clock, column) for column in values.T], axis=1)
        for lag in LAGS_S
    ]


def table(recordings: Sequence[Recording]) -> Iterator[str]:
    """Lines of the table."""
    ours = np.concatenate([each.ours for each in recordings])
    theirs = np.concatenate([each.theirs for each in recordings])
    speeds = np.concatenate([each.chin_speeds for each in recordings])
    both = (ours, theirs)
    shut = ours[:, OPENING] < OURS_SHUT_MM, theirs[:, OPENING] < SHUT_MM
    yield f"{len(recordings)} recordings, {len(ours)} frames of speech; ours, people's"
    r = np.mean([(each.r, each.told_r) for each in recordings], axis=0)
    for name, ours_r, told in zip(SHOWN, *r, strict=True):
        yield f"{f'r of {name}; of the trunk itself':40} {ours_r:7.3f} {told:7.3f}"
    bitten = np.concatenate([each.bitten_mm for each in recordings])
    yield f"{'gap in f and v, median, mm':40} {np.median(bitten):7.2f}"
    rows = {
        "correlation of chin and lip gap": [pearson(x[:, JAW], x[:, OPENING]) for x in both],
        "chin below rest, lips shut": [x[s, JAW].mean() for x, s in zip(both, shut, strict=True)],
        "chin speed, 95 %, mm/s": np.percentile(speeds, 95, axis=0),
        "lips shut, share of speech": [s.mean() for s in shut],
        "ours shut where theirs are": [shut[0][shut[1]].mean(), 1.0],
    }
    before = np.stack([each.before_mm for each in recordings])
    before = before[np.isfinite(before).all(axis=1)]
    if len(before) > 1:
        rows["gap before the first sound, mm"] = before.mean(axis=0)
        rows["the same, r over recordings"] = [pearson(*before.T), 1.0]
    for name, column in zip(SHOWN, range(len(FIELDS)), strict=True):
        rows[f"{name}, mean in speech"] = [x[:, column].mean() for x in both]
        rows[f"{name}, deviation"] = [x[:, column].std() for x in both]
    for name, (mine, people) in rows.items():
        yield f"{name:40} {mine:7.2f} {people:7.2f}"


def main(argv: Sequence[str] | None = None) -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("folder", type=Path)
    parser.add_argument("--names", type=Path, help="file of the names of recordings, one a line")
    parser.add_argument("--every", type=int, default=1, help="take each Nth of the names")
    parser.add_argument("--talker", help="take only recordings of this person")
    parser.add_argument("--model", default="talkers")
    parser.add_argument("--lookahead", type=float, help="of a live stream, s")
    given = parser.parse_args(argv)
    clips = find_tracked_mouths(given.folder)
    if given.names:
        names = set(given.names.read_text(encoding="utf-8").split()[:: given.every])
        clips = [clip for clip in clips if clip.path.stem in names]
    if given.talker:
        clips = [clip for clip in clips if clip.talker == given.talker]
    recordings = [
        each for clip in clips if (each := compared(clip, given.model, given.lookahead)) is not None
    ]
    print("\n".join(table(recordings)))


if __name__ == "__main__":
    main()
