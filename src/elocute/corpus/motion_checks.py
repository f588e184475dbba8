"""What can be wrong with the motion of a clip, looked at in blocks of frames."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.corpus.corpus_store import Corpus
from elocute.numerics.rigid_alignment import rigid_alignment, turned_degrees
from elocute.one_line_repr import one_line

BLOCK_FRAMES = 128
SPEED_MAX_M_S = 1.2  # 20 mm between frames at 60 a second; lips reach 0.3
SAMPLE_CLIPS, SAMPLE_FRAMES = 48, 8
MOVING_COUNT = 60
RIGID_SHARE = 0.3


@dataclass(frozen=True, eq=False)
class MotionRegions:
    """Vertices that move most, and least, in a corpus."""

    moving: NDArray[np.integer]  # (vertex,) those that move most: the mouth
    steady: NDArray[np.integer]  # (vertex,) those that move least

    __repr__ = one_line


@dataclass(frozen=True, eq=False)
class MotionFacts:
    """Measurements of one clip's motion."""

    activity: Float64Array  # (frame,) mean distance of the moving vertices from the template, mm
    broken: int | None = None  # first frame that is not finite
    jump: int | None = None  # frame after the largest jump
    jump_mm: float = 0.0  # its size, mm
    # Largest turn in degrees and shift in mm against the template.
    turned_deg: float = 0.0
    shifted_mm: float = 0.0
    posed: int = 0  # frame that is turned and shifted most


def find_motion_regions(corpus: Corpus) -> MotionRegions:
    """Find the vertices that move most and least within clips, from a sample of frames."""
    spread = np.zeros(corpus.vertex_count)
    entries = corpus.entries
    for index in np.unique(np.linspace(0, len(entries) - 1, SAMPLE_CLIPS).round().astype(int)):
        entry = entries[index]
        frames = sampled_frames(entry.frames)
        moved = np.concatenate([corpus.displacements(entry.name, f, f + 1) for f in frames])
        if np.isfinite(moved).all():
            spread += moved.astype(np.float64).var(axis=0).sum(axis=1)
    order = np.argsort(spread, kind="stable")
    count = len(order)
    moving = order[-max(1, min(MOVING_COUNT, count // 4)) :]
    return MotionRegions(np.sort(moving), np.sort(order[: max(4, round(RIGID_SHARE * count))]))


def sampled_frames(count: int) -> NDArray[np.integer]:
    """Up to `SAMPLE_FRAMES` frames of `count`, evenly spaced."""
    return np.unique(np.linspace(0, count - 1, SAMPLE_FRAMES).round().astype(int))


def examine_motion(corpus: Corpus, name: str, regions: MotionRegions) -> MotionFacts:
    """Measure a clip's motion in one pass; only `broken` is known where a frame is not finite."""
    activity, before, start = [], None, 0
    jump, jump_m = None, SPEED_MAX_M_S / corpus.fps
    for block in _blocks(corpus, name):
        finite = np.isfinite(block.reshape(len(block), -1)).all(axis=1)
        if not finite.all():
            return MotionFacts(np.zeros(0), broken=start + int(np.argmin(finite)))
        frames = block if before is None else np.concatenate([before, block])
        steps = _steps(corpus, frames)
        if len(steps) and steps.max() > jump_m:
            jump = start + int(steps.argmax()) + (before is None)
            jump_m = float(steps.max())
        activity.append(1000 * _distances(corpus, name, block, regions.moving))
        before, start = block[-1:], start + len(block)
    turned, shifted, posed = (0.0, 0.0, 0)
    whole = np.isfinite(corpus.template(corpus.entry(name).subject)).all()
    if corpus.kind == "vertices" and whole:  # weights on a basis have nothing to turn by
        turned, shifted, posed = _pose(corpus, name, regions.steady)
    found_mm = 1000 * jump_m if jump is not None else 0.0
    return MotionFacts(
        np.concatenate(activity), None, jump, found_mm, turned, 1000 * shifted, posed
    )


def rigid_motion(points: Float64Array, template: Float64Array) -> tuple[float, float]:
    """How far points are turned and shifted against a template.

    Parameters
    ----------
    points, template : (vertex, 3) float64
        The same points, m.

    Returns
    -------
    turn : float
        Degrees.
    shift : float
        Metres between the means.
    """
    rotation, _ = rigid_alignment(template, points)
    shift = points.mean(axis=0) - template.mean(axis=0)
    return turned_degrees(rotation), float(np.linalg.norm(shift))


def _blocks(corpus: Corpus, name: str) -> Iterator[NDArray[np.float32]]:
    """Frames of a clip, block after block."""
    frames = corpus.frames(name)
    for start in range(0, len(frames), BLOCK_FRAMES):
        yield np.asarray(frames[start : start + BLOCK_FRAMES])


def _steps(corpus: Corpus, frames: NDArray[np.float32]) -> Float64Array:
    """(frame - 1,) m that the fastest vertex moves from each frame to the next."""
    change = np.diff(frames, axis=0)
    if corpus.basis is None:
        return np.sqrt((change**2).sum(axis=2).max(axis=1)).astype(np.float64)
    basis = np.asarray(corpus.basis)
    # No vertex moves further than each weight alone could move one: few frames are expanded.
    most = np.abs(change) @ np.linalg.norm(basis, axis=2).max(axis=1)
    steps = np.zeros(len(change))
    for frame in np.flatnonzero(most > SPEED_MAX_M_S / corpus.fps):
        moved = np.tensordot(change[frame], basis, 1)
        steps[frame] = np.linalg.norm(moved, axis=1).max()
    return steps


def _distances(
    corpus: Corpus, name: str, block: NDArray[np.float32], moving: NDArray[np.integer]
) -> Float64Array:
    """(frame,) m, mean distance of the moving vertices from the template."""
    if corpus.basis is None:
        moved = block[:, moving] - corpus.template(corpus.entry(name).subject)[moving]
    else:
        moved = np.tensordot(block, corpus.basis[:, moving], 1)
    return np.linalg.norm(moved, axis=2).mean(axis=1).astype(np.float64)


def _pose(corpus: Corpus, name: str, steady: NDArray[np.integer]) -> tuple[float, float, int]:
    """Largest turn (degrees) and shift (m) of some frames, and the frame that turned most."""
    entry = corpus.entry(name)
    template = corpus.template(entry.subject)[steady].astype(np.float64)
    turns, shifts, frames = [], [], sampled_frames(entry.frames)
    for frame in frames:
        points = np.asarray(corpus.frames(name)[frame][steady], np.float64)
        turn, shift = rigid_motion(points, template)
        turns.append(turn)
        shifts.append(shift)
    worst = int(np.argmax(np.array(turns) / 2 + np.array(shifts) / 0.005))
    return max(turns), max(shifts), int(frames[worst])
