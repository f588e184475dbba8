""".npz and .npy: motion, heads, registered frames, features."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from tests.fuzz.fuzzing import seeds
from tests.fuzz.fuzzing.cases import Reader
from tests.fuzz.fuzzing.readers.one_file import only


def _motion(path: Path) -> None:
    from elocute.motion.store import load_motion

    motion = load_motion(path)
    motion.vertices()
    _ = motion.head.triangles, motion.head.uv_triangles, motion.head.triangle_material


def _head(path: Path) -> None:
    from elocute.head.registry import open_head

    head = open_head(path)
    head.with_identity(np.ones(len(head.identity_basis), np.float32))
    _ = head.triangles, head.uv_triangles, head.triangle_material, head.eye_distance_m


def _vertex_list(path: Path) -> None:
    from elocute.evaluation.vertex_regions import read_vertex_region

    read_vertex_region(path, 100, region="lips")


def _frame(path: Path) -> None:
    from elocute.capture.sequence_tracking import (
        read_frame_record,
        read_pose,
        read_registration,
        read_zero,
    )

    record = read_frame_record(path, "key")
    if record is not None and not record.flag:
        read_zero(path)
        read_pose(path)
        read_registration(path, record)


def _features(folder: Path, _out: Path) -> None:
    from elocute.training.crnn.feature_cache import open_feature_cache

    cache = open_feature_cache(folder)
    for clip in cache.clips:
        np.asarray(cache.columns(clip))
        np.asarray(cache.parameters(clip))


def _track(path: Path, _out: Path) -> None:
    from elocute.corpus.importers.grid import read_tracked_lips

    read_tracked_lips(path / "clip.npz")


def _take(path: Path, _out: Path) -> None:
    from elocute.evaluation.tracked_mouths import find_tracked_mouths, read_tracked_mouth

    for take in find_tracked_mouths(path):
        read_tracked_mouth(take)


READERS: tuple[Reader, ...] = (
    Reader("motion", seeds.motions, only(_motion), {"*.npz": "npz"}, ("elocute.motion.store",)),
    Reader("head", seeds.heads, only(_head), {"*.npz": "npz"}, ("elocute.head.registry",)),
    Reader(
        "frame",
        seeds.frames,
        only(_frame),
        {"*.npz": "npz"},
        ("elocute.capture.sequence_tracking",),
    ),
    Reader(
        "vertex list",
        seeds.vertex_lists,
        only(_vertex_list),
        {"*.npy": "npy", "*.json": "json", "*.npz": "npz", "*.pkl": "pickle", "*.txt": "text"},
        ("elocute.evaluation.vertex_regions",),
    ),
    Reader("track", seeds.tracks, _track, {"*.npz": "npz"}, ("elocute.corpus.importers.grid",)),
    Reader(
        "take",
        seeds.tracks,
        _take,
        {"*.npz": "npz"},
        ("elocute.evaluation.tracked_mouths",),
    ),
    Reader(
        "features",
        seeds.features,
        _features,
        {"*.json": "json", "*.npy": "npy"},
        ("elocute.training.crnn.feature_cache",),
        needs=("torch", "pyarrow"),
    ),
)
