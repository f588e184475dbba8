"""How an animated mouth moves, beside the tracked mouths of people who say the same.

    python -m benchmarks.mouth_motion DATA/grid_s1/clips --names DATA/grid_s1/dev.txt
    python -m benchmarks.mouth_motion DATA/talkers/dev --talker edtalk_pose2

All in mm on the built-in head: what people do is scaled by the distance of the outer eye corners.
Rest is the median of frames in which the ear hears nobody. Correlations are of each recording, at
the best of lags up to 0.12 s.
"""

from __future__ import annotations

import argparse
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from elocute.animation import animate
from elocute.array_types import Float64Array
from elocute.audio.phones_and_visemes import SILENCE
from elocute.audio.read import read_audio
from elocute.audio.waveform import SPEECH_RATE
from elocute.encoders.phone_encoder import builtin_encoder
from elocute.encoders.protocol import FEATURE_RATE
from elocute.evaluation.tracked_mouths import TrackedClip, find_tracked_mouths, read_tracked_mouth
from elocute.files.array_reading import read_npz
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import measure_mouth
from elocute.numerics.correlation import pearson

FIELDS = ("inner_opening_mean", "lip_width", "protrusion", "jaw", "upper_lip", "lower_lip")
SHOWN = ("opening", "width", "protrusion", "jaw", "upper lip", "lower lip")
OPENING, JAW = 0, 3
LAGS_S = np.arange(-0.12, 0.121, 0.02)
SHUT_MM, OURS_SHUT_MM = 1.8, 0.1  # trackers see a gap between lips that touch
TRACKED_LEAST, REST_LEAST = 0.9, 5  # share of frames, and frames
FPS = 60
NOSE, LIP_TOP, LIP_BOTTOM, CHIN, CORNERS = 33, 51, 57, 8, (48, 54)


def six_measures(motion: Motion) -> Float64Array:
    """(frame, 6) mm in the order of `FIELDS`, as the tracker of the recordings measures them."""
    head = motion.head
    kept = head.landmarks[[NOSE, LIP_TOP, LIP_BOTTOM, CHIN, *CORNERS]]
    basis = head.expression_basis[:, kept].reshape(len(head.expression_names), -1)
    points = (motion.weights @ basis).reshape(motion.frame_count, len(kept), 3)
    nose, top, bottom, chin, left, right = np.moveaxis(points + head.template[kept], 1, 0)
    front = (top[:, 2] + bottom[:, 2] - left[:, 2] - right[:, 2]) / 2
    apart = [np.linalg.norm(a - b, axis=1) for a, b in ((nose, chin), (top, nose), (nose, bottom))]
    width = np.linalg.norm(left - right, axis=1)
    opening = measure_mouth(motion)["opening_mm"] / 1000
    return 1000 * np.stack([opening, width, front, *apart], axis=1).astype(np.float64)


@dataclass(frozen=True, eq=False)
class Recording:
    """Frames of speech of one recording, less rest; the gap as it is.

    Attributes
    ----------
    ours, theirs : (frame, 6) float64
        Of the animated head and of the person, mm.
    r : (6,) float64
        Best correlation of each measure, over all frames that were tracked.
    chin_speeds : (pair, 2) float64
        Ours and theirs, mm/s.
    """

    ours: Float64Array
    theirs: Float64Array
    r: Float64Array
    chin_speeds: Float64Array


def compared(found: TrackedClip, model: str) -> Recording | None:
    """One recording beside the animated head; None where a tenth of it was not tracked."""
    fields = read_npz(
        found.path,
        max_bytes=16_000_000,
        allowed="a tracked mouth",
        only=frozenset((*FIELDS, "t", "valid")),
    )
    tracked = np.stack([np.asarray(fields[name], float) for name in FIELDS], axis=1)
    seen = np.isfinite(tracked).all(axis=1) & (np.asarray(fields["valid"]) > 0)
    if seen.mean() < TRACKED_LEAST:
        return None
    times_s = np.asarray(fields["t"], float) - found.offset_s
    sound = read_audio(read_tracked_mouth(found).sound, sample_rate=SPEECH_RATE)
    motion = animate(sound, model=model, fps=FPS, life=0).motion
    mine, clock = six_measures(motion), np.arange(motion.frame_count) / FPS
    still = np.zeros((1, motion.weights.shape[1]), np.float32)
    at_rest = six_measures(Motion(motion.head, still, FPS))[0]
    theirs = tracked * 1000 * motion.head.eye_distance_m
    lagged = [
        np.stack([np.interp(times_s - lag, clock, column) for column in mine.T], axis=1)
        for lag in LAGS_S
    ]
    r = [
        max(pearson(each[seen, k], theirs[seen, k]) for each in lagged) for k in range(len(FIELDS))
    ]
    silence = np.exp(builtin_encoder().encode(sound.samples)[:, SILENCE])
    quiet = np.interp(times_s, np.arange(len(silence)) / FEATURE_RATE, silence) > 0.5
    resting = seen & quiet
    if resting.sum() < REST_LEAST:
        resting = seen & (tracked[:, JAW] <= np.percentile(tracked[seen, JAW], 10))
    rest = np.median(theirs[resting], axis=0)
    rest[OPENING] = at_rest[OPENING] = 0
    ours, spoken = lagged[len(LAGS_S) // 2], seen & ~quiet
    pairs = spoken[1:] & spoken[:-1]
    speeds = [np.abs(np.diff(each[:, JAW]))[pairs] for each in (ours, theirs)]
    return Recording(
        (ours - at_rest)[spoken],
        (theirs - rest)[spoken],
        np.array(r),
        np.stack(speeds, axis=1) / np.median(np.diff(times_s)),
    )


def table(recordings: Sequence[Recording]) -> Iterator[str]:
    """Lines of the table."""
    ours = np.concatenate([each.ours for each in recordings])
    theirs = np.concatenate([each.theirs for each in recordings])
    speeds = np.concatenate([each.chin_speeds for each in recordings])
    both = (ours, theirs)
    shut = ours[:, OPENING] < OURS_SHUT_MM, theirs[:, OPENING] < SHUT_MM
    yield f"{len(recordings)} recordings, {len(ours)} frames of speech; ours, people's"
    for name, r in zip(SHOWN, np.mean([each.r for each in recordings], axis=0), strict=True):
        yield f"{f'r of {name}':40} {r:7.3f}"
    rows = {
        "correlation of chin and lip gap": [pearson(x[:, JAW], x[:, OPENING]) for x in both],
        "chin below rest, lips shut": [x[s, JAW].mean() for x, s in zip(both, shut, strict=True)],
        "chin speed, 95 %, mm/s": np.percentile(speeds, 95, axis=0),
        "lips shut, share of speech": [s.mean() for s in shut],
        "ours shut where theirs are": [shut[0][shut[1]].mean(), 1.0],
    }
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
    given = parser.parse_args(argv)
    clips = find_tracked_mouths(given.folder)
    if given.names:
        names = set(given.names.read_text(encoding="utf-8").split()[:: given.every])
        clips = [clip for clip in clips if clip.path.stem in names]
    if given.talker:
        clips = [clip for clip in clips if clip.talker == given.talker]
    recordings = [each for clip in clips if (each := compared(clip, given.model)) is not None]
    print("\n".join(table(recordings)))


if __name__ == "__main__":
    main()
