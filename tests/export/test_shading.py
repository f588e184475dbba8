"""What pictures show of images, shadows and cards; and that GLSL and NumPy say the same."""

from dataclasses import replace

import numpy as np
import pytest

from elocute.errors import HeadError
from elocute.head.builtin import load_builtin_head
from elocute.head.surface import Surface
from elocute.render import Camera, Stage, available_backends, open_renderer
from elocute.render.lights import RIGS
from elocute.render.parts import Parts
from elocute.render.shading import (
    FINISHES,
    Point,
    finish_of,
    ground,
    lit,
    shown,
    to_linear,
    to_srgb,
)
from tests.export.heads import picture, plain, sheets

SIZE = (200, 200)
BACKENDS = [pytest.param("moderngl", marks=pytest.mark.system), "embreex"]
STRAIGHT = Camera(np.array([0, 0, 1], np.float32), np.zeros(3, np.float32), 7.0)


@pytest.fixture
def draw(need):
    def drawn(head, backend="embreex", *, points=None, quality="fast", **stage):
        if backend == "moderngl":
            need(available_backends()["moderngl"].startswith("works"), "EGL (libegl1)")
        look = Stage(quality=quality, **stage)
        with open_renderer(head, SIZE, backend=backend, camera=STRAIGHT, stage=look) as renderer:
            return renderer.frame(head.template if points is None else points).astype(int)

    return drawn


MIDDLE = slice(60, 140), slice(60, 140)


@pytest.mark.parametrize("backend", BACKENDS)
def test_what_stands_before_the_key_casts_a_shadow(draw, backend):
    """The key stands at the upper left, so the shadow falls to the lower right."""
    head = sheets([0.0, 0.0], [plain(), plain(both_sides=True)])
    clear, shaded = head.template.copy(), head.template.copy()
    front = slice(len(head.template) // 2, None)
    clear[front, 0] -= 0.25  # out of the picture
    shaded[front] = shaded[front] * 0.3 + [-0.02, 0.03, 0.04]
    change = draw(head, backend, points=shaded) - draw(head, backend, points=clear)
    assert change[90:112, 95:120].mean() < -25
    assert np.abs(change[130:150, 30:60]).max() <= 2  # beside it
    assert np.abs(change[40:60, 130:150]).max() <= 2


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_normal_map_changes_the_light(draw, backend):
    level = np.full((8, 8, 3), (128, 128, 255))
    left, right = level.copy(), level.copy()
    left[..., 0], right[..., 0] = 92, 164
    toward, away, bare = (
        draw(sheets([0.0], [plain(normal=picture(image))]), backend)[MIDDLE].mean()
        for image in (left, right, level)
    )
    # The key stands at the left of the picture.
    assert toward > bare > away + 1
    flat = draw(sheets([0.0], [plain(normal=picture(right), normal_scale=0.0)]), backend)
    assert abs(flat[MIDDLE].mean() - bare) < 0.5


@pytest.mark.parametrize("backend", BACKENDS)
def test_an_image_shows_where_it_belongs(draw, backend):
    """Red above, blue at the right: up is up, and nothing is mirrored."""
    image = np.full((64, 64, 3), 90)
    image[:32, :, 0] = 220
    image[:, 32:, 2] = 220
    drawn = draw(sheets([0.0], [Surface(color=picture(image), roughness_factor=0.9)]), backend)
    upper, lower = drawn[50:90, 50:150].mean((0, 1)), drawn[110:150, 50:150].mean((0, 1))
    left, right = drawn[50:150, 50:90].mean((0, 1)), drawn[50:150, 110:150].mean((0, 1))
    assert upper[0] > lower[0] + 60
    assert right[2] > left[2] + 60


def card(alpha):
    """A surface whose right half has an alpha, its left none."""
    image = np.zeros((64, 64, 4))
    image[..., 1] = 255
    image[:, 32:, 3] = alpha
    return picture(image)


@pytest.mark.parametrize("backend", BACKENDS)
@pytest.mark.parametrize(
    ("opacity", "alpha", "share"),
    [
        ("cutout", 255, 1),
        ("cutout", 100, 0),
        ("cutout", 160, 1),
        ("blend", 255, 1),
        ("blend", 102, 0.5),  # full where the core begins, at 204
        ("sheer", 255, 1),
        ("sheer", 102, 0.4),
    ],
)
def test_cards_are_solid_blended_or_not_there(draw, backend, opacity, alpha, share):
    behind = Surface(color=picture(np.full((4, 4, 3), (128, 0, 0))), roughness_factor=0.9)
    worn = Surface(color=card(alpha), opacity=opacity, roughness_factor=0.9)
    names = ["skin", "lashes"]  # lashes cast no shadow
    drawn = draw(sheets([0.0, 0.01], [behind, worn], names), backend)
    bare = draw(sheets([0.0], [behind], ["skin"]), backend)
    solid = Surface(color=card(255), opacity="cutout", roughness_factor=0.9)
    whole = draw(sheets([0.0, 0.01], [behind, solid], names), backend)
    left, right = (slice(70, 130), slice(60, 90)), (slice(70, 130), slice(110, 140))
    assert np.abs(drawn[left] - bare[left]).mean() < 1.5
    wanted = share * whole[right] + (1 - share) * bare[right]
    assert np.abs(drawn[right] - wanted).mean() < 2.5


@pytest.mark.parametrize("backend", BACKENDS)
def test_cutouts_keep_their_edge(draw, backend):
    """An edge is no wider than two pixels, and where the image has it."""
    behind = Surface(color=picture(np.full((4, 4, 3), (128, 0, 0))), roughness_factor=0.9)
    worn = Surface(color=card(255), opacity="cutout", roughness_factor=0.9)
    drawn = draw(sheets([0.0, 0.002], [behind, worn], ["skin", "lashes"]), backend)
    row = drawn[100, :, 1] - drawn[100, :, 0]
    turned = np.flatnonzero((row[50:150] > -60) & (row[50:150] < 60)) + 50
    assert len(turned) <= 2
    assert np.all(np.abs(np.flatnonzero(row[50:150] > 0)[0] + 50 - 100) <= 2)


@pytest.mark.parametrize("backend", BACKENDS)
def test_without_ground_alpha_is_exact(draw, backend):
    head = sheets([0.0], [plain()])
    clear = draw(head, backend, transparent=True)
    laid = draw(head, backend)
    assert clear.shape == (200, 200, 4)
    assert set(np.unique(clear[..., 3][10:190, 105:190])) >= {0, 255}
    assert np.all(clear[:5, :, :] == 0)
    assert np.all(clear[MIDDLE][..., 3] == 255)
    assert np.abs(clear[MIDDLE][..., :3] - laid[MIDDLE]).max() <= 1


@pytest.mark.parametrize("backend", BACKENDS)
def test_a_backdrop_lies_behind(draw, backend):
    head = sheets([0.0], [plain()])
    drawn = draw(head, backend, backdrop=np.full((1, 1, 3), (0, 128, 255), np.uint8))
    assert np.abs(drawn[:5] - [0, 128, 255]).max() <= 1
    picture = np.zeros((50, 100, 3), np.uint8)
    picture[:, 50:] = 250
    drawn = draw(head, backend, backdrop=picture)  # its middle square is shown
    assert drawn[5, 5].max() <= 1
    assert drawn[5, 195].min() >= 248


@pytest.mark.system
@pytest.mark.parametrize("quality", ["fast", "high"])
def test_both_engines_agree_on_images_cards_and_shadows(draw, quality):
    generator = np.random.default_rng(5)
    image = np.repeat(np.repeat(generator.integers(60, 220, (8, 8, 3)), 16, 0), 16, 1)
    bumps = np.clip(128 + generator.normal(0, 25, (64, 64, 3)), 0, 255)
    bumps[..., 2] = 240
    skin = Surface(color=picture(image), normal=picture(bumps), roughness_factor=0.5)
    hair = Surface(color=card(255), opacity="blend", both_sides=True)
    head = sheets([0.0, 0.02], [skin, hair], ["skin", "hair"])
    points = head.template.copy()
    points[:625, 2] += 0.02 * np.cos(points[:625, 0] * 40)
    points[625:, :2] *= 0.5
    ours, theirs = (
        draw(head, name, points=points, quality=quality) for name in ("moderngl", "embreex")
    )
    difference = np.abs(ours - theirs).mean(axis=2)
    assert difference.mean() < 2.0
    assert np.percentile(difference, 97) < 14


def test_dark_skin_is_exposed_for_longer():
    head = load_builtin_head()
    light, dark = (
        Parts(replace(head, vertex_color=(head.vertex_color * scale).astype(np.uint8)))
        for scale in (1.0, 0.45)
    )
    studio = RIGS["studio"]
    assert 1.2 < dark.exposure(studio) / light.exposure(studio) < 2


def test_the_tone_curve_keeps_hue_and_order():
    light = np.linspace(0, 4, 200)[:, None] * np.array([1.0, 0.7, 0.5])
    color = shown(light.astype(np.float32), 1.0)
    assert np.all(np.diff(color, axis=0) >= -1e-4)
    assert color.max() <= 1.001
    linear = to_linear(color)
    assert np.allclose(linear[20:60, 1] / linear[20:60, 0], 0.7, atol=0.06)


def test_square_roots_are_near_enough_to_srgb():
    x = np.linspace(0, 1, 4096, dtype=np.float32)
    exact = np.where(x <= 0.0031308, 12.92 * x, 1.055 * x ** (1 / 2.4) - 0.055)
    assert np.abs(to_srgb(x) - exact).max() < 0.6 / 255


def test_light_is_finite_whatever_the_point():
    generator = np.random.default_rng(3)

    def unit():
        v = generator.normal(size=(500, 3))
        return (v / np.linalg.norm(v, axis=1, keepdims=True)).astype(np.float32)

    def share():
        return generator.random((500, 1)).astype(np.float32)

    for finish in FINISHES.values():
        for rig in RIGS.values():
            albedo = generator.random((500, 3)).astype(np.float32)
            point = Point(
                albedo, unit(), unit(), unit(), unit(), share(), share().clip(0.05), share()
            )
            out = lit(point, finish, rig)
            assert np.isfinite(out).all()
            assert out.min() >= 0
    assert ground(np.array([[0.5, 0.5]], np.float32), RIGS["studio"]).shape == (1, 3)


def test_materials_find_their_finish():
    assert finish_of("eyeball") is FINISHES["eyeball"]
    assert finish_of("hair_long") is FINISHES["hair"]
    assert finish_of("lashes") is FINISHES["hair"]
    assert finish_of("polySurface12") is FINISHES["skin"]


def test_a_broken_image_is_told(draw):
    with pytest.raises(HeadError, match="color of skin_0"):
        draw(sheets([0.0], [Surface(color=b"no image at all")]))
