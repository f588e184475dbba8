"""What seeds of every kind are made with: a place, a hum, a small head that moves."""

from __future__ import annotations

import importlib.util
import sys
from dataclasses import replace
from pathlib import Path
from types import ModuleType

import numpy as np

from elocute.head.mesh import head_from_arrays
from elocute.head.model import HeadModel
from elocute.motion.motion import Motion

ROOT = Path(__file__).resolve().parents[4]
RATE = 16000
VERTICES = 80


def module(path: str) -> ModuleType:
    """A file of tests, imported: what writes VOCASET and Python 2's pickles stands there."""
    spec = importlib.util.spec_from_file_location(Path(path).stem + "_of_tests", ROOT / path)
    assert spec and spec.loader
    made = importlib.util.module_from_spec(spec)
    sys.modules[spec.name] = made
    spec.loader.exec_module(made)
    return made


def place(folder: Path, name: str) -> Path:
    """A new folder for one seed."""
    (folder / name).mkdir(parents=True)
    return folder / name


def tone(seconds: float = 0.2, rate: int = RATE) -> np.ndarray:
    """(sample,) float32: a hum that swells."""
    time_s = np.arange(round(seconds * rate)) / rate
    swell = np.abs(np.sin(7 * time_s))
    return (0.4 * swell * np.sin(2 * np.pi * 210 * time_s)).astype(np.float32)


def small_head(name: str = "small") -> HeadModel:
    """A ball as large as a head that names places as the built-in head does."""
    rng = np.random.default_rng(0)
    points = rng.normal(size=(VERTICES, 3))
    points = (0.12 * points / np.linalg.norm(points, axis=1, keepdims=True)).astype(np.float32)
    faces = np.stack([np.arange(VERTICES - 2), np.arange(1, VERTICES - 1), np.arange(2, VERTICES)])
    shapes = np.zeros((3, VERTICES, 3), np.float32)
    shapes[:, :20, 1] = -0.01 * np.arange(1, 4)[:, None]
    head = head_from_arrays(
        name, points, faces.T, expression_names=("jawOpen", "a", "b"), expression_basis=shapes
    )
    ring = np.arange(8, dtype=np.int32)
    return replace(
        head,
        joint_names=("head", "jaw"),
        joint_parents=(-1, 0),
        joint_positions=np.zeros((2, 3), np.float32),
        skin_weights=np.full((VERTICES, 2), 0.5, np.float32),
        identity_basis=np.ones((2, VERTICES, 3), np.float32) * np.float32(1e-3),
        joint_identity_basis=np.zeros((2, 2, 3), np.float32),
        landmarks=np.arange(68, dtype=np.int32),
        lip_rings=np.stack([ring, ring + 8]),
        outer_lip_upper=ring,
        outer_lip_lower=ring + 8,
        inner_lip_upper=ring + 16,
        inner_lip_lower=ring + 24,
        outer_corners=np.array([0, 7], np.int32),
        inner_corners=np.array([1, 6], np.int32),
        mirror=np.arange(VERTICES, dtype=np.int32),
        regions={"lips": ring, "face": np.arange(40, dtype=np.int32)},
        tone_basis=np.array([0.5, 0.1, 0.1], np.float32),
    )


def small_motion(frames: int = 5, turning: bool = True) -> Motion:
    head = small_head()
    weights = np.linspace(0, 1, frames * 3, dtype=np.float32).reshape(frames, 3)
    turns = np.zeros((frames, 2, 4), np.float32)
    turns[..., 0] = 1
    return Motion(head, weights, 30.0, turns if turning else None)
