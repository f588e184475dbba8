"""The GRID corpus's lips: a talker tracked in video, as weights of the built-in head.

A folder holds `NAME.ogg` and `NAME.npz`: `lip_xyz` (frame, 43, 3) pixels of MediaPipe's face
mesh at `lip_idx`, heads aligned with one another within a clip, x to the right of the picture, y
down, depth weak and away from the camera; `eye_dist_px`; distances in units of the outer
eye-corner distance (`inner_opening_mean`, `lip_width`, `jaw`, `lower_lip`, `upper_lip`, the
last three from the nose); `fps`, `valid` and `words`, a JSON text of [start s, end s, word].
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.audio.read import read_audio
from elocute.audio.waveform import SPEECH_RATE
from elocute.corpus.clip import Clip
from elocute.corpus.corpus_writing import corpus_writer
from elocute.corpus.importers.import_report import Progress, require_clips
from elocute.corpus.importers.lip_fit import SPEECH_SHAPES, LipMotion, fit_lips, lip_shape_effects
from elocute.corpus.importers.split_choice import choose_splits
from elocute.errors import AudioError, CorpusError
from elocute.files.array_reading import read_npz
from elocute.files.json_records import parse_json
from elocute.files.reading import FileKind
from elocute.head.builtin import load_builtin_head
from elocute.head.mediapipe_face_mesh import (
    INNER_LOWER,
    INNER_UPPER,
    LIP_CONTOURS,
    UNDER_NOSE,
)
from elocute.motion.motion import FPS_MAX
from elocute.motion.mouth_measures import TRACKED_CLOSED, TRACKED_RESTING, tracked_opening_share
from elocute.numerics.monotone_cubic import monotone_cubic
from elocute.numerics.resampling import interpolate
from elocute.numerics.smoothing import gaussian_smoothed

SUBJECT = "grid"
NOTE = "A talker tracked in video (GRID audio-visual corpus, Cooke et al. 2006, CC BY 4.0)."
CALM_FRAMES = 2.0  # standard deviation of the blur that steadies the nose
FRAMES_MAX = 100_000
ALLOWED = "the fields of grid_s1"
FIELDS_MAX_BYTES = 16_000_000
FIELDS_FILE = FileKind(ALLOWED, FIELDS_MAX_BYTES, CorpusError)
SCALARS = ("inner_opening_mean", "lip_width", "jaw", "lower_lip", "upper_lip")
SILENCE = ("sil", "sp", "")


@dataclass(frozen=True, eq=False)
class TrackedLips:
    """The lips of a clip in units of the outer eye-corner distance, y up, z out of the face."""

    name: str  # of the clip
    fps: float  # frames per second
    # (frame, contour, point, 3) from the point below the nose, along `LIP_CONTOURS`.
    points: Float64Array
    scalars: dict[str, Float64Array]  # distances by name, those of `SCALARS`
    words: tuple[str, ...]  # what is said


def grid_clips(
    folder: str | Path, *, leave_out: set[str], fps: float, skipped: list[str] | None = None
) -> Iterator[tuple[Clip, float]]:
    """Fit the built-in head to the clips of a folder, one after another, at a frame rate.

    Yields each clip and the RMS distance that its fit leaves in x and y, mm. Subjects are called
    `grid` and sentences as their files. Names in `leave_out` are not even opened; `skipped` gets a
    line for each clip that cannot be read. Raises CorpusError where no clip is left.
    """
    notes = skipped if skipped is not None else []
    paths = [p for p in sorted(Path(folder).glob("*.npz")) if p.stem not in leave_out]
    if not paths:
        raise CorpusError.about(folder, found="no NAME.npz", allowed="clips tracked in video")
    rest = resting_lips(paths)
    head = load_builtin_head()
    rows = lip_shape_effects(head, rest.points[0])
    columns = [head.expression_index(name) for name in SPEECH_SHAPES]
    scale = 1000 * head.eye_distance_m
    count = 0
    for path in paths:
        try:
            track = read_tracked_lips(path)
            sound = read_audio(path.with_suffix(".ogg"), sample_rate=SPEECH_RATE)
        except (CorpusError, AudioError) as error:
            notes.append(str(error))
            continue
        weights, residual_mm = fit_lips(rows, lip_motion(track, rest, scale))
        frames = np.zeros((round(sound.duration_s * fps), len(head.expression_names)), np.float32)
        times = np.arange(len(frames)) / fps
        frames[:, columns] = np.clip(
            monotone_cubic(np.arange(len(weights)), weights, times * track.fps), 0, 1
        )
        yield Clip(SUBJECT, path.stem, " ".join(track.words), sound, frames), residual_mm
        count += 1
    if not count:
        raise CorpusError.about(folder, found="no clip that can be read", allowed="see the notes")


def convert_grid(
    source: Path,
    output: Path,
    *,
    fps: float = 60.0,
    leave_out: frozenset[str] = frozenset(),
    split: str | None = None,
    progress: Progress = None,
) -> list[str]:
    """Convert all clips of `source`, or of `source/clips`, as `registry.convert` does.

    A line for each thing that was skipped, the residual, and the split. Raises CorpusError where no
    clip can be used; nothing is written then.
    """
    folder = source / "clips" if (source / "clips").is_dir() else source
    total = max(1, sum(p.stem not in leave_out for p in folder.glob("*.npz")))
    head = load_builtin_head()
    notes: list[str] = []
    residuals: list[float] = []
    with corpus_writer(
        output,
        {SUBJECT: head.template},
        fps=fps,
        basis=head.expression_basis,
        components=head.expression_names,
        faces=head.quads,
        topology=head.name,
        note=NOTE,
    ) as writer:
        for clip, residual_mm in grid_clips(
            folder, leave_out=set(leave_out), fps=fps, skipped=notes
        ):
            writer.add(clip)
            residuals.append(residual_mm)
            if progress:
                progress((len(residuals) + len(notes)) / total)
        require_clips(writer, source, notes)
        notes.append(f"residual: {np.median(residuals):.2f} mm (median over clips)")
        numbers = {entry.name: entry.sentence for entry in writer.entries}
        writer.splits |= choose_splits(writer.entries, numbers, split, notes)
    return notes


def read_tracked_lips(path: Path) -> TrackedLips:
    """Read one tracked clip (.npz); frames without a face are interpolated.

    Raises CorpusError for missing fields, unusable numbers, or fewer than two frames with a face.
    """
    fields = read_npz(path, FIELDS_FILE)
    try:
        return _tracked_lips(path, fields)
    except CorpusError:
        raise
    except (KeyError, ValueError, TypeError, IndexError, OverflowError) as error:
        raise FIELDS_FILE.unusable(path, f"no tracked lips in it ({str(error)[:80]})") from error


def _tracked_lips(path: Path, fields: dict[str, NDArray[Any]]) -> TrackedLips:
    """The lips in the fields of a file; raises what NumPy raises where they do not fit."""
    pixels = np.asarray(fields["lip_xyz"], np.float64)
    if pixels.ndim != 3 or pixels.shape[2] != 3 or len(pixels) > FRAMES_MAX:
        raise ValueError(f"lip_xyz of shape {pixels.shape}")
    index = {int(number): place for place, number in enumerate(fields["lip_idx"].tolist())}
    unit = float(np.ravel(fields["eye_dist_px"])[0])
    valid = np.flatnonzero(np.asarray(fields["valid"]) > 0.5)
    scalars = {name: np.asarray(fields[name], np.float64) for name in SCALARS}
    rows = parse_json(str(fields["words"]), path, allowed=ALLOWED, error=CorpusError)
    words = [str(word) for _, _, word in rows]
    fps = float(fields["fps"])
    if not 0 < fps <= FPS_MAX or not 0 < unit < np.inf:
        raise ValueError("no rate or unit")
    if any(len(values) != len(pixels) for values in scalars.values()):
        raise ValueError("fields of different lengths")
    contours = [[index[number] for number in contour] for contour in LIP_CONTOURS]
    nose = gaussian_smoothed(_bridged(pixels[:, index[UNDER_NOSE]], valid), CALM_FRAMES)
    points = _bridged(pixels, valid)[:, contours] - nose[:, None, None]
    scalars = {name: _bridged(values, valid) for name, values in scalars.items()}
    with np.errstate(over="ignore", invalid="ignore"):
        points = points * [1, -1, -1] / unit
    if not np.isfinite(points).all():
        raise FIELDS_FILE.unusable(path, "points that are not finite")
    said = tuple(word for word in words if word not in SILENCE)
    return TrackedLips(path.stem, fps, points, scalars, said)


def resting_lips(paths: list[Path]) -> TrackedLips:
    """The talker at rest, one frame: the median of frames with nearly closed lips, over clips.

    Clips without such a frame, or that cannot be read, do not count. Raises CorpusError where none
    does.
    """
    points: list[Float64Array] = []
    scalars: dict[str, list[float]] = {name: [] for name in SCALARS}
    for path in paths:
        try:
            track = read_tracked_lips(path)
        except CorpusError:
            continue
        resting = track.scalars["inner_opening_mean"] < TRACKED_CLOSED
        if resting.any():
            points.append(np.median(track.points[resting], axis=0))
            for name, values in scalars.items():
                values.append(float(np.median(track.scalars[name][resting])))
    if not points:
        raise CorpusError.about(
            paths[0].parent, found="nowhere a closed mouth", allowed="lips that rest at times"
        )
    medians = {name: np.array([np.median(values)]) for name, values in scalars.items()}
    return TrackedLips("rest", 1.0, np.median(points, axis=0)[None], medians, ())


def lip_motion(track: TrackedLips, rest: TrackedLips, scale: float) -> LipMotion:
    """What moved from rest, at the size of a head, whose outer eye corners are `scale` mm apart.

    A tracker sees a small gap between lips that touch; it is removed where lips are nearly closed,
    so that closed means closed on the head. The mouth as a whole stays in the middle: seen from the
    front, a head that turns looks like a jaw that slides.
    """
    seen = track.scalars["inner_opening_mean"]
    ease = tracked_opening_share(seen)
    points = scale * (track.points - rest.points)
    points[..., 0] -= points[..., 0].mean(axis=(1, 2), keepdims=True)
    upper, lower = LIP_CONTOURS.index(INNER_UPPER), LIP_CONTOURS.index(INNER_LOWER)
    middle = (points[:, upper] + points[:, lower]) / 2
    half = ease[:, None, None] * (points[:, upper] - points[:, lower]) / 2
    points[:, upper], points[:, lower] = middle + half, middle - half
    change = {name: scale * (track.scalars[name] - rest.scalars[name]) for name in SCALARS}
    return LipMotion(
        points,
        scale * ease * np.maximum(seen - TRACKED_RESTING, 0),
        seen < TRACKED_CLOSED,
        change["lip_width"],
        change["upper_lip"],
        change["lower_lip"],
        change["jaw"],
    )


def _bridged(values: Float64Array, valid: NDArray[np.integer]) -> Float64Array:
    """Frames (frame, …) without a face or a finite number, interpolated from those around them."""
    flat = values.reshape(len(values), -1)
    good = valid[np.isfinite(flat[valid]).all(axis=1)]
    if len(good) < 2:
        raise ValueError("fewer than two valid frames")
    return interpolate(good, flat[good], np.arange(len(flat))).reshape(values.shape)
