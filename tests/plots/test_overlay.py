"""Many curves in one picture, read back from its pixels."""

import numpy as np
import pytest
from PIL import Image

from elocute.errors import OutputError
from elocute.motion.curves import Curves
from elocute.plots.curves import HEIGHT, INKS, SHADE, WIDTH, plot_overlay, plot_panels

LOW_AND_HIGH = Curves(
    np.stack([np.full(60, 2.0), np.full(60, 8.0)], axis=1).astype(np.float32), ("low", "high"), 60
)
"""One second; 10 mm is the top of the axis."""


def drawn(path, curves, **options):
    plot_overlay(curves, path, **options)
    with Image.open(path) as picture:
        return np.asarray(picture).astype(int)


def of_colour(picture, ink, within=40):
    """(height, width) True where the picture has that colour, nearly."""
    wanted = np.array([int(ink[i : i + 2], 16) for i in (1, 3, 5)])
    return np.abs(picture - wanted).max(axis=2) < within


def test_every_curve_has_its_ink_at_its_height(tmp_path):
    picture = drawn(tmp_path / "p.png", LOW_AND_HIGH, shade=False)
    assert picture.shape == (HEIGHT, WIDTH, 3)
    rows = [np.flatnonzero(of_colour(picture, ink)[:, WIDTH // 2]) for ink in INKS[:2]]
    floor, ceiling = HEIGHT - 50, 50
    for found, share in zip(rows, (0.2, 0.8), strict=True):
        assert found.mean() == pytest.approx(floor + share * (ceiling - floor), abs=2)


def test_the_shade_fills_what_lies_between(tmp_path):
    shaded = of_colour(drawn(tmp_path / "p.png", LOW_AND_HIGH), SHADE, within=4)
    # 6 of 10 mm, but for the two curves at its ends.
    assert shaded[:, WIDTH // 2 + 7].sum() == pytest.approx(0.6 * (HEIGHT - 100), abs=12)
    plain = drawn(tmp_path / "q.png", LOW_AND_HIGH, shade=False)
    assert (plain[HEIGHT // 2 + 20, WIDTH // 2 + 7] == 255).all()


def test_names_stand_on_the_right(tmp_path):
    picture = drawn(tmp_path / "p.png", LOW_AND_HIGH)
    for ink in INKS[:2]:
        assert of_colour(picture, ink)[:, WIDTH - 180 :].sum() > 20


@pytest.mark.parametrize("values", [np.zeros((30, 1)), np.ones((1, 1)), np.full((2, 1), 1e5)])
def test_flat_single_and_huge_curves_are_drawn(tmp_path, values):
    picture = drawn(tmp_path / "p.png", Curves(values.astype(np.float32), ("one",), 30), title="t")
    assert (picture < 128).any()


def test_nothing_is_left_where_nothing_can_be_written(tmp_path):
    with pytest.raises(OutputError, match="does not exist"):
        plot_overlay(LOW_AND_HIGH, tmp_path / "none" / "p.png")
    (tmp_path / "folder.png").mkdir()
    with pytest.raises(OutputError, match="a folder"):
        plot_overlay(LOW_AND_HIGH, tmp_path / "folder.png")
    assert [path.name for path in tmp_path.iterdir()] == ["folder.png"]


def test_panels_stand_below_each_other(tmp_path):
    for path, panels in (("one.png", 1), ("three.png", 3)):
        plot_panels([("a title", LOW_AND_HIGH)] * panels, tmp_path / path, unit="mm")
        with Image.open(tmp_path / path) as picture:
            assert picture.size == (WIDTH, panels * HEIGHT)
    with Image.open(tmp_path / "one.png") as one, Image.open(tmp_path / "three.png") as three:
        for place in range(3):
            box = (0, place * HEIGHT, WIDTH, (place + 1) * HEIGHT)
            assert three.crop(box).tobytes() == one.tobytes()
