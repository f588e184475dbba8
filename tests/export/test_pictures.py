"""What a picture may be told: background, framing, light and quality."""

from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from elocute.errors import OutputError
from elocute.export.options import PictureOptions
from elocute.export.pictures import open_pictures
from elocute.head.builtin import load_builtin_head
from elocute.render import available_backends
from elocute.render.lights import RIGS
from tests.support.commands import refused

SIZE = (160, 160)
BACKENDS = [pytest.param("moderngl", marks=pytest.mark.system), "embreex"]


@pytest.fixture(scope="module")
def head():
    return load_builtin_head()


@pytest.fixture
def drawn(need, head):
    def draw(size=SIZE, backend="embreex", **options):
        if backend == "moderngl":
            need(available_backends()["moderngl"].startswith("works"), "EGL (libegl1)")
        with open_pictures(head, size, PictureOptions(backend=backend, **options)) as renderer:
            return renderer.frame(head.template.astype(np.float32)).astype(int)

    return draw


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(
    ("background", "colour"), [("#1e2a38", (30, 42, 56)), ("white", (255, 255, 255))]
)
def test_a_colour_lies_behind_the_head(drawn, backend, background, colour):
    picture = drawn(backend=backend, background=background)
    assert np.abs(picture[:20, :20] - colour).max() <= 1
    assert np.abs(picture[60:90, 70:90] - drawn(backend=backend)[60:90, 70:90]).max() <= 1


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_picture_fills_the_frame_uncropped_in_its_middle(drawn, backend, tmp_path):
    """Twice as wide as the frame: its outer quarters are cut off, and nothing is squeezed."""
    wide = np.zeros((100, 200, 3), np.uint8)
    wide[:, :50], wide[:, 50:100], wide[:, 100:150], wide[:, 150:] = 10, 80, 160, 240
    Image.fromarray(wide).save(tmp_path / "wall.png")
    picture = drawn(backend=backend, background=str(tmp_path / "wall.png"))
    assert np.abs(picture[:12, 5:50] - 80).max() <= 2
    assert np.abs(picture[:12, 110:155] - 160).max() <= 2


@pytest.mark.system
@pytest.mark.parametrize("light", list(RIGS))
def test_both_engines_agree_in_every_light(drawn, light):
    ours, theirs = (drawn(backend=name, light=light) for name in ("moderngl", "embreex"))
    difference = np.abs(ours - theirs).mean(axis=2)
    assert difference.mean() < 2.0 and np.percentile(difference, 97) < 12


@pytest.mark.system
def test_both_engines_agree_on_what_is_transparent(drawn):
    ours, theirs = (
        drawn(backend=name, background="transparent") for name in ("moderngl", "embreex")
    )
    assert ours.shape == theirs.shape == (160, 160, 4)
    assert np.abs(ours - theirs)[..., 3].mean() < 2.0
    solid = (ours[..., 3] == 255) & (theirs[..., 3] == 255)
    assert np.abs(ours - theirs)[solid].mean() < 2.0


def test_lights_differ(drawn):
    pictures = {light: drawn(light=light, background="grey") for light in RIGS}
    for one in RIGS:
        for other in RIGS:
            if one < other:
                assert np.abs(pictures[one] - pictures[other])[50:110, 50:110].mean() > 4
    left, right = (
        pictures["dramatic"][60:100, side].mean() for side in (slice(50, 70), slice(90, 110))
    )
    assert left > 1.5 * right


@pytest.mark.parametrize("size", [(160, 160), (90, 160), (284, 160)])
def test_no_shape_of_picture_cuts_the_head(drawn, size):
    alpha = drawn(size=size, background="transparent")[..., 3]
    rows = slice(0, int(0.6 * size[1]))
    assert alpha[0].max() == 0 and alpha[rows, 0].max() == 0 and alpha[rows, -1].max() == 0
    assert 0.4 * min(size) < (alpha[rows] > 128).any(axis=0).sum() < 0.95 * size[0]


def test_a_face_fills_more_of_the_picture(drawn):
    head, face = (
        drawn(framing=framing, background="transparent")[..., 3] > 128
        for framing in ("head", "face")
    )
    assert face.mean() > 1.4 * head.mean()


def test_high_quality_is_smoother_and_shows_the_same(drawn):
    fast, high = (drawn(quality=quality, backend="moderngl") for quality in ("fast", "high"))
    assert 0 < np.abs(fast - high).mean() < 3


@pytest.mark.parametrize(
    ("background", "said"),
    [
        ("purple", "allowed: studio, transparent, black"),
        ("#12345", "unknown"),
        ("#12345g", "unknown"),
        ("wall.tiff", "unknown"),
        ("missing.png", "no such file"),
        ("", "unknown"),
    ],
)
def test_what_is_no_background(background, said):
    with pytest.raises(OutputError, match=said):
        PictureOptions(background=background)


def test_a_background_that_cannot_be_read(drawn, tmp_path):
    for name, data in (("torn.png", b"\x89PNG\r\n\x1a\n123"), ("text.jpg", b"hello")):
        (tmp_path / name).write_bytes(data)
        with pytest.raises(OutputError, match="cannot be read"):
            drawn(background=str(tmp_path / name))
    Image.new("1", (9000, 9000)).save(tmp_path / "vast.png")
    with pytest.raises(OutputError, match="9000 x 9000 pixels"):
        drawn(background=str(tmp_path / "vast.png"))


def test_no_output_replaces_its_background(speech_wav, tmp_path):
    wall = tmp_path / "wall.png"
    Image.new("RGB", (64, 64)).save(wall)
    before = wall.read_bytes()
    more = ("--background", wall, "--overwrite")
    refused("animate", speech_wav, "-o", wall, *more, says="wall.png")
    assert wall.read_bytes() == before


@pytest.mark.parametrize("who", ["otto", "hana"])
def test_clothes_do_not_push_the_camera_back(who):
    from elocute.animation import identity_head
    from elocute.head.looks import dress, identity_look
    from elocute.render import portrait

    head = identity_head(who)
    look = identity_look("auto", who)
    assert look is not None
    away = [
        float(np.linalg.norm(camera.position - camera.target))
        for camera in (portrait(dress(head, replace(look, hair="none"))), portrait(head))
    ]
    assert away[0] == pytest.approx(away[1], rel=0.02)
