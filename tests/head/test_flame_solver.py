"""Parameters that FLAME's equations gave, found again from the vertices."""

from typing import Any

import numpy as np
import pytest

from elocute.errors import HeadError
from elocute.head.flame import flame_vertices, load_flame
from elocute.head.flame_parameters import (
    FlameParameters,
    load_flame_parameters,
    save_flame_parameters,
)
from elocute.head.flame_solver import solve_flame
from tests.support.flame_layout import flame_layout

FRAMES = 3


@pytest.fixture(scope="module")
def model(python2, tmp_path_factory):
    path = tmp_path_factory.mktemp("flame") / "generic_model.pkl"
    path.write_bytes(python2.dumps(flame_layout().entries))
    return load_flame(path)


@pytest.fixture(scope="module")
def shape():
    values = np.zeros(300)
    values[:50] = np.random.default_rng(0).normal(0, 0.8, 50)
    return values


@pytest.fixture(scope="module")
def moving(shape):
    rng = np.random.default_rng(1)
    pose = rng.normal(0, 0.05, (FRAMES, 15))
    pose[:, 6] = np.linspace(0.05, 0.3, FRAMES)
    expression = np.cumsum(rng.normal(0, 0.3, (FRAMES, 100)), axis=0)
    return FlameParameters(shape, expression, pose, rng.normal(0, 0.05, (FRAMES, 3)))


@pytest.mark.slow
def test_everything_is_found_again(model, moving):
    found, residual_mm = solve_flame(model, moving.vertices(model))
    assert residual_mm.max() < 0.01
    given = moving.vertices(model)
    assert np.abs(found.vertices(model) - given).max() < 1e-4
    assert np.abs(found.shape - moving.shape)[:50].max() < 0.02
    assert np.abs(found.expression - moving.expression).max() < 0.02
    assert np.degrees(np.abs(found.pose - moving.pose).max()) < 0.1
    assert 1000 * np.abs(found.translation - moving.translation).max() < 0.1


def test_as_vocaset_has_it(model, moving):
    """Zero pose, a neutral face beside, single precision, flat rows: only the jaw turns."""
    jaw = np.zeros_like(moving.pose)
    jaw[:, 6:9] = moving.pose[:, 6:9]
    given = flame_vertices(model, moving.shape, moving.expression, jaw)
    neutral = flame_vertices(model, moving.shape)[0]
    flat = given.astype(np.float32).reshape(FRAMES, -1)
    shares = []
    found, residual_mm = solve_flame(
        model, flat, neutral=neutral, zero_pose=True, progress=shares.append
    )
    assert residual_mm.max() < 0.005 and shares[-1] == 1
    assert np.abs(found.expression - moving.expression).max() < 0.01
    assert np.degrees(np.abs(found.pose - jaw).max()) < 0.02
    assert not found.translation.any() and not found.pose[:, :6].any()


@pytest.mark.slow
def test_noise_is_not_explained(model, moving):
    given = moving.vertices(model)
    noise = np.random.default_rng(2).normal(0, 5e-4, given.shape)
    found, residual_mm = solve_flame(model, given + noise, regularisation=5e-5)
    assert residual_mm.mean() == pytest.approx(0.5 * np.sqrt(8 / np.pi), rel=0.03)
    assert 1000 * np.linalg.norm(found.vertices(model) - given, axis=2).mean() < 0.15


def test_files_hold_them(moving, tmp_path):
    save_flame_parameters(tmp_path / "p.npz", moving)
    again = load_flame_parameters(tmp_path / "p.npz")
    assert np.array_equal(again.pose, moving.pose) and again.fps == 60.0
    with np.load(tmp_path / "p.npz") as stored:
        arrays = dict(stored)
    for change, word in (
        ({"pose": arrays["pose"][:1]}, "do not fit"),
        ({"shape": arrays["shape"][None]}, "no usable shape"),
        ({"expression": np.full((FRAMES, 100), np.nan)}, "no usable expression"),
        ({"fps": np.float64(0)}, "do not fit"),
    ):
        spoilt: dict[str, Any] = arrays | change
        np.savez(tmp_path / "bad.npz", **spoilt)
        with pytest.raises(HeadError, match=word):
            load_flame_parameters(tmp_path / "bad.npz")


@pytest.mark.parametrize(
    ("vertices", "options", "word"),
    [
        (np.zeros((2, 7, 3)), {}, "5023, 3"),
        (np.zeros((0, 5023, 3)), {}, "5023, 3"),
        (np.zeros((1, 5023, 3), int), {}, "floats"),
        (np.full((1, 5023, 3), np.nan), {}, "NaN"),
        (np.zeros((1, 5023, 3)), {"regularisation": 0}, "above 0"),
        (np.zeros((1, 5023, 3)), {"neutral": np.zeros((3, 3))}, "neutral"),
    ],
)
def test_what_is_refused(model, vertices, options, word):
    with pytest.raises(HeadError, match=word):
        solve_flame(model, vertices, **options)
