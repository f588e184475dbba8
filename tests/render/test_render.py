"""Pictures: both engines agree, and they show a face."""

import numpy as np
import pytest

from elocute.errors import InputError
from elocute.head.builtin import load_builtin_head
from elocute.render import available_backends, open_renderer, portrait

SIZE = (240, 240)


@pytest.fixture(scope="module")
def head():
    return load_builtin_head()


def posed(head, **weights):
    shift = np.tensordot(head.expression_vector(weights), head.expression_basis, 1)
    return (head.template + shift).astype(np.float32)


@pytest.fixture
def draw(need, head):
    def drawn(backend, view="front", **weights):
        if backend == "moderngl":
            need(available_backends()["moderngl"].startswith("works"), "EGL (libegl1)")
        camera = portrait(head, view)
        with open_renderer(head, SIZE, backend=backend, camera=camera) as renderer:
            return renderer.frame(posed(head, **weights)).astype(int)

    return drawn


BACKENDS = [pytest.param("moderngl", marks=pytest.mark.system), "embreex"]


@pytest.mark.system
@pytest.mark.parametrize("view", ["front", "three-quarter", "side", "mouth"])
def test_both_engines_draw_the_same(draw, view):
    ours, theirs = (draw(name, view, jawOpen=0.4) for name in ("moderngl", "embreex"))
    difference = np.abs(ours - theirs).mean(axis=2)
    assert difference.mean() < 2.0
    assert np.percentile(difference, 97) < 12  # of 255; edges are smoothed differently


@pytest.mark.parametrize("backend", BACKENDS)
def test_the_mouth_is_darker_inside_than_the_lips(draw, backend):
    closed = draw(backend, "mouth")
    opened = draw(backend, "mouth", jawOpen=0.7)
    middle = slice(110, 150), slice(105, 135)
    assert opened[middle].mean() < 0.8 * closed[middle].mean()


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_blink_hides_the_eyes(draw, backend):
    awake = draw(backend)
    asleep = draw(backend, eyeBlinkLeft=1, eyeBlinkRight=1)
    assert np.abs(awake - asleep).max() > 60


@pytest.mark.parametrize("backend", BACKENDS)
def test_the_same_frame_is_drawn_the_same_again(draw, backend):
    assert np.array_equal(draw(backend, jawOpen=0.3), draw(backend, jawOpen=0.3))


@pytest.mark.parametrize("backend", BACKENDS)
def test_frames_in_a_row_are_those_drawn_alone(draw, head, backend):
    mouths = [{"jawOpen": opened} for opened in (0.0, 0.4, 0.8, 0.2)]
    alone = [draw(backend, **mouth) for mouth in mouths]
    with open_renderer(head, SIZE, backend=backend, camera=portrait(head)) as renderer:
        frames = renderer.frames(posed(head, **mouth) for mouth in mouths)
        first = next(frames)
        between = renderer.frame(posed(head, **mouths[2]))  # while others are still drawn
        rest = list(frames)
    assert np.array_equal([first, *rest], alone)
    assert np.array_equal(between, alone[2])


def test_nothing_is_burnt_out_or_black(draw):
    picture = draw("embreex")
    face = picture[60:180, 80:160]
    assert (face.max(axis=2) >= 252).mean() < 0.01
    assert 90 < face.mean() < 215


def test_what_does_not_exist_is_refused(head):
    with pytest.raises(InputError, match="backend"):
        open_renderer(head, SIZE, backend="crayons")
    with pytest.raises(InputError, match="three-quarter"):
        portrait(head, "above")
