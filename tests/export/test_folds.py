"""Folds that come with expressions look the same in both engines and in the page."""

from __future__ import annotations

import io
import json
from dataclasses import replace

import numpy as np
import pytest

from elocute.animation import identity_head
from elocute.export.gltf import glb_bytes
from elocute.export.html import write_html
from elocute.export.options import GlbOptions
from elocute.head import HeadModel
from elocute.head.looks import PEOPLE
from elocute.head.looks.folds import folds_of
from elocute.motion.motion import Motion
from elocute.render import Camera, Stage, available_backends, open_renderer, portrait
from tests.support.browser import headless_browser, open_viewer

SIZE = (320, 320)
BACKENDS = [pytest.param("moderngl", marks=pytest.mark.system), "embreex"]
UP = {"browInnerUp": 1.0, "browOuterUpLeft": 1.0, "browOuterUpRight": 1.0}
SCOWL = {"browDownLeft": 1.0, "browDownRight": 1.0, "noseSneerLeft": 1.0, "noseSneerRight": 1.0}
SMILE = {
    "mouthSmileLeft": 1.0, "mouthSmileRight": 1.0, "cheekSquintLeft": 1.0, "cheekSquintRight": 1.0,
}  # fmt: skip
POSES = (UP, SCOWL, SMILE)


@pytest.fixture(scope="module")
def motion() -> Motion:
    """An old face that holds each pose for two frames; bald, so that skin alone is compared."""
    head = replace(identity_head("otto"), look=replace(PEOPLE["otto"], hair="none"))
    rows = [head.expression_vector(pose) for pose in POSES for _ in range(2)]
    return Motion(head, np.stack(rows), 2.0)


@pytest.fixture(scope="module")
def worn(motion: Motion) -> HeadModel:
    return motion.dressed().head


def smooth(head: HeadModel) -> HeadModel:
    """The same with skin that never folds."""
    skin = replace(head.surfaces["skin"], folds=b"")
    return replace(head, surfaces={**head.surfaces, "skin": skin})


def posed(head: HeadModel, weights: dict[str, float]) -> np.ndarray:
    shift = np.tensordot(head.expression_vector(weights), head.expression_basis, 1)
    return (head.template + shift).astype(np.float32)


def forehead(head: HeadModel) -> Camera:
    """Looks at the forehead and the brows."""
    target = head.template[head.landmarks[17:27]].mean(0) + np.array([0, 0.018, 0], np.float32)
    away = np.array([0, 0, 0.4], np.float32)
    return Camera(target + away, target, 12.0)


@pytest.fixture
def draw(need):
    def drawn(head, weights, backend, view=forehead, quality="fast"):
        if backend == "moderngl":
            need(available_backends()["moderngl"].startswith("works"), "EGL (libegl1)")
        stage = Stage(quality=quality)
        with open_renderer(head, SIZE, backend=backend, camera=view(head), stage=stage) as renderer:
            return renderer.frame(posed(head, weights)).astype(int)

    return drawn


@pytest.mark.parametrize("backend", BACKENDS)
def test_raised_brows_draw_lines_across_the_forehead(draw, worn, backend):
    """Lines lie across: rows differ in their change, columns hardly do."""
    change = draw(worn, UP, backend) - draw(smooth(worn), UP, backend)
    middle = change[10:130, 90:230].mean(axis=2)
    rows, columns = middle.mean(axis=1), middle.mean(axis=0)
    assert rows.min() < -8  # dark in the creases
    assert rows.max() > rows.min() + 10
    assert rows.std() > 2 * columns.std()


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_face_at_rest_is_drawn_as_without_folds(draw, worn, backend):
    assert np.abs(draw(worn, {}, backend) - draw(smooth(worn), {}, backend)).max() <= 1


@pytest.mark.slow
@pytest.mark.system
@pytest.mark.parametrize("quality", ["fast", "high"])
@pytest.mark.parametrize("pose", [UP, SMILE], ids=["up", "smile"])
def test_both_engines_draw_the_same_folds(draw, worn, pose, quality):
    view = forehead if pose is UP else portrait
    ours, theirs = (draw(worn, pose, name, view, quality) for name in ("moderngl", "embreex"))
    difference = np.abs(ours - theirs).mean(axis=2)
    assert difference.mean() < 2.0
    assert np.percentile(difference, 97) < 12
    if pose is UP:  # what folds alone change is the same too
        change = [
            drawn - draw(smooth(worn), pose, name, view, quality)
            for drawn, name in ((ours, "moderngl"), (theirs, "embreex"))
        ]
        one, two = (each[10:130, 60:260].mean(axis=2).ravel() for each in change)
        assert np.corrcoef(one, two)[0, 1] > 0.9


def test_only_our_own_pages_are_told_of_folds(motion):
    ours, plain = (
        json.loads(data[20 : 20 + int.from_bytes(data[12:16], "little")])
        for data in (
            glb_bytes(motion, options=GlbOptions(profile="elocute"), for_viewer=for_viewer)
            for for_viewer in (True, False)
        )
    )
    told = [p for p in ours["meshes"][0]["primitives"] if "_FOLDS_0" in p["attributes"]]
    assert [ours["materials"][p["material"]]["name"] for p in told] == ["skin"]
    assert "folds" in ours["materials"][told[0]["material"]]["extras"]
    assert "FOLDS" not in json.dumps(plain)
    assert "folds" not in json.dumps(plain)


@pytest.fixture(scope="module")
def page(need, motion, tmp_path_factory):
    folder = tmp_path_factory.mktemp("folds")
    write_html(motion, folder / "page.html")
    with headless_browser(need, folder / "profile", "500,640") as driver:
        driver.set_script_timeout(120)
        open_viewer(driver, folder / "page.html")
        yield driver


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.parametrize("number", range(len(POSES)))
def test_the_page_finds_the_same_strengths(page, motion, worn, number):
    page.execute_script(f"elocute.jump({number + 0.2}); elocute.show();")
    found = page.execute_script("return Array.from(elocute.folds.strengths)")
    folds = folds_of(worn)
    assert folds is not None
    wanted = folds.strengths(worn.template, posed(worn, POSES[number]))
    assert wanted.max() > 0.5
    np.testing.assert_allclose(found, wanted * worn.surfaces["skin"].fold_depth, atol=0.01)


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.system
def test_the_page_draws_the_same_folds(page, need, motion, worn):
    from PIL import Image

    need(available_backends()["moderngl"].startswith("works"), "EGL (libegl1)")
    raw = page.execute_async_script(
        "const told = arguments[0]; elocute.jump(0.2); elocute.show();"
        "setTimeout(() => { elocute.show(); document.querySelector('canvas').toBlob(async (b) =>"
        "told(Array.from(new Uint8Array(await b.arrayBuffer())))); }, 1500);"
    )
    ours = np.asarray(Image.open(io.BytesIO(bytes(raw))).convert("RGBA")).astype(int)
    size = (ours.shape[1], ours.shape[0])
    filmed = []
    for head in (worn, smooth(worn)):
        with open_renderer(head, size, camera=portrait(head), backend="moderngl") as renderer:
            filmed.append(renderer.frame(posed(head, UP)).astype(int))
    solid = ours[..., 3] == 255
    assert np.abs(ours[..., :3] - filmed[0])[solid].mean() < 4
    # Where folds show, the page is nearer to the film with them than to the one without.
    shows = solid & (np.abs(filmed[0] - filmed[1]).mean(axis=2) > 6)
    with_folds, without = (np.abs(ours[..., :3] - each)[shows].mean() for each in filmed)
    assert with_folds < 0.6 * without
