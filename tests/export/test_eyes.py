"""An iris lies behind its cornea: aslant it is seen where the cornea bends the view to."""

from dataclasses import replace

import numpy as np
import pytest

from elocute.errors import HeadError
from elocute.export.render import Camera, Stage, available_backends, open_renderer
from elocute.head.builtin import load_builtin_head
from elocute.head.looks import PEOPLE, dress
from elocute.head.surface import surface_arrays, surfaces_of_arrays

SIZE = (300, 200)
FIELD_DEG, AWAY_M = 6.0, 0.25
MM_OF_PX = 2000 * AWAY_M * np.tan(np.radians(FIELD_DEG / 2)) / SIZE[1]
BACKENDS = [pytest.param("moderngl", marks=pytest.mark.system), "embreex"]


@pytest.fixture(scope="module")
def head():
    return dress(load_builtin_head(), replace(PEOPLE["ben"], lashes=0.0))


def pupil_px(head, backend, aside_deg):
    """The middle of the left pupil along a row of the picture."""
    eye = head.template[head.regions["eye_left"]]
    middle = np.array([*eye.mean(0)[:2], eye[:, 2].max()])
    aside = np.radians(aside_deg)
    away = AWAY_M * np.array([np.sin(aside), 0, np.cos(aside)])
    camera = Camera((middle + away).astype("f4"), middle.astype("f4"), FIELD_DEG)
    stage = Stage(quality="high")
    with open_renderer(head, SIZE, backend=backend, camera=camera, stage=stage) as renderer:
        picture = renderer.frame(head.template).astype(int)
    down, across = SIZE[1] // 2, SIZE[0] // 2
    shown = picture[down - 30 : down + 50, across - 70 : across + 70].max(axis=2)
    dark = np.nonzero(shown < 55)
    assert len(dark[1]) > 150, "no pupil"
    return np.median(dark[1])


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_pupil_seen_aslant_lies_further_back(head, backend, need):
    if backend == "moderngl":
        need(available_backends()["moderngl"].startswith("works"), "EGL (libegl1)")
    painted = replace(head.surfaces["eyeball"], iris_depth=0.0)
    flat = replace(head, surfaces={**head.surfaces, "eyeball": painted})
    assert abs(pupil_px(head, backend, 0) - pupil_px(flat, backend, 0)) <= 1
    # Half a right angle aside the view goes on at 32 degrees inside, 1.0 mm further over an iris
    # 1.6 mm deep: 0.7 mm in the picture.
    moved = pupil_px(head, backend, 45) - pupil_px(flat, backend, 45)
    assert 0.5 < moved * MM_OF_PX < 0.9


def test_files_keep_the_iris_and_refuse_an_impossible_one(head):
    eye = head.surfaces["eyeball"]
    assert surfaces_of_arrays(surface_arrays({"eyeball": eye})) == {"eyeball": eye}
    for wrong in ({"eye_rad": 0.0}, {"iris_rad": -0.4}, {"iris_depth": 9.0}):
        stored = surface_arrays({"eyeball": replace(eye, **wrong)})
        with pytest.raises(HeadError, match="iris"):
            surfaces_of_arrays(stored)
