"""What lips let in: inside a mouth it is darker and warmer the smaller the opening, everywhere."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from elocute.animation import identity_head
from elocute.export.html import write_html
from elocute.head import HeadModel
from elocute.head.looks import PEOPLE
from elocute.head.mouth_opening import NO_LIPS_M, mouth_opening, openness
from elocute.head.viseme_shapes import VISEME_SHAPES
from elocute.motion.motion import Motion
from elocute.render import Camera, Stage, available_backends, open_renderer
from elocute.render.parts import Parts
from tests.support.browser import headless_browser, open_viewer

SIZE = (240, 240)
BACKENDS = [pytest.param("moderngl", marks=pytest.mark.system), "embreex"]
POSES = ("ou", "aa")


@pytest.fixture(scope="module")
def motion() -> Motion:
    head = replace(identity_head("ben"), look=replace(PEOPLE["ben"], hair="none"))
    rows = [head.expression_vector(VISEME_SHAPES[name]) for name in POSES for _ in range(2)]
    return Motion(head, np.stack(rows), 2.0)


@pytest.fixture(scope="module")
def worn(motion: Motion) -> HeadModel:
    return motion.dressed().head


def posed(head: HeadModel, viseme: str) -> np.ndarray:
    shift = np.tensordot(head.expression_vector(VISEME_SHAPES[viseme]), head.expression_basis, 1)
    return (head.template + shift).astype(np.float32)


@pytest.fixture
def draw(need):
    def drawn(head, viseme, backend):
        if backend == "moderngl":
            need(available_backends()["moderngl"].startswith("works"), "EGL (libegl1)")
        target = head.template[head.landmarks[48:68]].mean(0)
        camera = Camera(target + np.array([0, 0, 0.4], np.float32), target, 8.0)
        with open_renderer(
            head, SIZE, backend=backend, camera=camera, stage=Stage(quality="fast")
        ) as renderer:
            return renderer.frame(posed(head, viseme)).astype(int)

    return drawn


def test_the_smaller_the_opening_the_less_light_and_the_less_the_deeper(worn):
    teeth = worn.regions["teeth_lower"]
    light = {}
    for name in POSES:
        points = posed(worn, name)
        open_ = openness(mouth_opening(worn, points), points[teeth])[:, 0]
        front = points[teeth, 2] > np.quantile(points[teeth, 2], 0.9)
        assert open_[~front].mean() < 0.8 * open_[front].mean()
        light[name] = open_[front].mean()
    assert light["ou"] < 0.6 * light["aa"]


def test_upper_teeth_are_in_the_shade_of_the_upper_lip(worn):
    points = posed(worn, "E")
    opening, middle = mouth_opening(worn, points), len(worn.inner_lip_upper) // 2
    upper, lower = (lip[middle] for lip in (worn.inner_lip_upper, worn.inner_lip_lower))
    places = np.repeat(opening[1:2, :3] - [0, 0, 0.003], 2, axis=0)
    places[:, 1] = points[[upper, lower], 1]
    below_the_upper_lip, over_the_lower_lip = openness(opening, places)[:, 0]
    assert below_the_upper_lip < 0.85 * over_the_lower_lip


def test_skin_is_as_open_as_ever_and_so_is_a_head_without_lips(worn):
    parts, points = Parts(worn), posed(worn, "ou")
    open_ = parts.openness(points)
    skin = next(part for part in parts.parts if part.name == "skin")
    inner = next(part for part in parts.parts if part.name == "tongue")
    lining = next(part for part in parts.parts if part.name == "mouth")
    alone = np.setdiff1d(skin.triangles, lining.triangles)
    assert (open_[alone] == 1).all()
    assert open_[np.unique(inner.triangles)].max() < 0.5
    none = np.zeros(0, np.int32)
    bare = replace(
        worn,
        inner_lip_upper=none,
        inner_lip_lower=none,
        inner_corners=none,
        lip_rings=none[:, None],
    )
    assert (mouth_opening(bare, points) == NO_LIPS_M).all()


@pytest.mark.parametrize("backend", BACKENDS)
def test_teeth_behind_round_lips_are_dark_and_not_blue(draw, worn, backend):
    picture = draw(worn, "ou", backend)
    inside = picture[112:128, 108:132].reshape(-1, 3)
    assert inside.mean() < 120
    assert (inside[:, 0] + 2 >= inside[:, 2]).all()


@pytest.mark.slow
@pytest.mark.system
@pytest.mark.parametrize("viseme", POSES)
def test_both_engines_draw_the_same_mouth(draw, worn, viseme):
    ours, theirs = (draw(worn, viseme, name) for name in ("moderngl", "embreex"))
    difference = np.abs(ours - theirs).mean(axis=2)
    assert difference.mean() < 2.0
    assert np.percentile(difference, 97) < 12


@pytest.mark.slow
@pytest.mark.browser
def test_the_page_finds_the_same_opening(need, motion, worn, tmp_path):
    write_html(motion, tmp_path / "page.html")
    with headless_browser(need, tmp_path / "profile", "500,640") as driver:
        driver.set_script_timeout(120)
        open_viewer(driver, tmp_path / "page.html")
        for number, viseme in enumerate(POSES):
            driver.execute_script(f"elocute.jump({number + 0.2}); elocute.show();")
            found = driver.execute_script("return elocute.mouth.opening.map((each) => [...each])")
            wanted = mouth_opening(worn, posed(worn, viseme))
            np.testing.assert_allclose(found, wanted, atol=2e-4)
