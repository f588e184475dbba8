"""Characters of others as pictures and pages show them: their own vertices, materials and place."""

import base64
import gzip
import io
import re
from dataclasses import replace

import numpy as np
import pytest
from PIL import Image

from elocute.adoption.characters.open_character import character_head, open_character
from elocute.animation import animate
from elocute.errors import ElocuteWarning, HeadError
from elocute.export.character_weights import character_motion
from elocute.export.drawn_character import drawn, placement
from elocute.export.options import PictureOptions
from elocute.export.pictures import open_pictures
from elocute.export.registry import write
from elocute.motion.motion import Motion
from elocute.render.camera import portrait
from elocute.render.shading import to_srgb
from tests.support import strange_heads
from tests.support.gltf_files import glb, parts_of_glb
from tests.support.strange_heads import UNLIT, painted, rigged, tree_of


@pytest.fixture(scope="module")
def take(speech_wav):
    """Half a second of the example, with a head that turns."""
    motion = animate(speech_wav, fps=30, look="none").motion
    turns = motion.rotations
    assert turns is not None
    return replace(motion, weights=motion.weights[20:35], rotations=turns[20:35])


@pytest.fixture(scope="module")
def face():
    points, triangles = strange_heads.face()
    shapes = strange_heads.arkit_shapes()
    kept = ("jawOpen", "mouthClose", "eyeBlinkLeft", "eyeBlinkRight", "mouthPucker")
    return points, triangles, {name: shapes[name] for name in kept}


@pytest.fixture
def played(take, tmp_path):
    """The take on a character of these bytes."""

    def on(data: bytes, name: str = "hero.glb") -> Motion:
        (tmp_path / name).write_bytes(data)
        return replace(take, head=character_head(open_character(tmp_path / name).character))

    return on


def test_its_own_vertices_move_by_the_weights_of_its_file(face, played):
    points, triangles, shapes = face
    motion = played(strange_heads.character(points, triangles, shapes))
    moved = character_motion(motion, motion.head.character)
    shown, place = drawn(motion), placement(motion.head.character)
    wanted = points + np.einsum("s,svc->vc", moved.weights[0][9], list(shapes.values()))
    wanted = wanted @ place[:3, :3].T + place[:3, 3]
    # Vertices may stand in another order: each is somewhere.
    found = shown.vertices(9, 10)[0]
    away = np.linalg.norm(found[:, None] - wanted[None, ::7], axis=2).min(axis=0)
    assert away.max() < 1e-5
    assert set(shown.names) <= set(shapes) and shown.fps == motion.fps


@pytest.mark.parametrize(
    "root",
    [
        {},
        {"turn": (0, np.pi, 0)},
        {"turn": (0, 0.7, 0), "scale": (100.0, 100.0, 100.0)},
        {"turn": (0.0, -0.3, 0.0), "scale": (-1.0, 1.0, 1.0)},
    ],
    ids=["as it is", "looks back", "centimetres", "mirrored"],
)
def test_joints_turn_as_in_its_file(face, played, root):
    motion = played(rigged(face, **root))
    character = motion.head.character
    moved, place = character_motion(motion, character), placement(character)
    nodes = [dict(node) for node in character.document.records("nodes")]
    for node, turns in moved.turns.items():
        nodes[node]["rotation"] = turns[9].tolist()
    assert 1 in moved.turns
    world = tree_of(nodes).world(2)
    points, _, shapes = face
    wanted = points + np.einsum("s,svc->vc", moved.weights[2][9], list(shapes.values()))
    wanted = (wanted @ world[:3, :3].T + world[:3, 3]) @ place[:3, :3].T + place[:3, 3]
    found = drawn(motion).vertices(9, 10)[0]
    away = np.linalg.norm(found[:, None] - wanted[None, ::7], axis=2).min(axis=0)
    assert away.max() < 1e-4


def test_size_and_direction_of_a_file_change_no_picture(face, played):
    plain = drawn(played(rigged(face)))
    for root in ({"turn": (0, np.pi, 0)}, {"scale": (100.0, 100.0, 100.0)}):
        other = drawn(played(rigged(face, **root)))
        assert np.allclose(portrait(other.head).position, portrait(plain.head).position, atol=1e-4)
        assert np.allclose(np.ptp(other.head.template, axis=0), np.ptp(plain.head.template, axis=0))


def test_a_face_without_eyes_is_drawn_from_ahead(face, played):
    points, triangles, shapes = face
    plain = drawn(played(strange_heads.character(*face))).head.template
    back, lying = np.diag([-1.0, 1, -1]), np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    for turn in (back, lying):
        moved = {name: shape @ turn for name, shape in shapes.items()}
        data = strange_heads.character(points @ turn, triangles, moved)
        assert np.abs(drawn(played(data)).head.template - plain).max() < 1e-4


def test_a_body_and_the_ears_of_a_hare_change_no_framing(face, played):
    points, triangles, shapes = face
    alone = portrait(drawn(played(strange_heads.character(*face))).head)
    bars = np.array(
        [
            [0, 0.1, 0],
            [0.02, 0.6, 0],
            [-0.02, 0.6, 0],
            [0, -0.1, -0.05],
            [0.3, -1.5, 0],
            [-0.3, -1.5, 0],
        ]
    )
    more = len(points) + np.array([[0, 1, 2], [3, 5, 4]])
    grown = {name: np.vstack([each, np.zeros((6, 3))]) for name, each in shapes.items()}
    data = strange_heads.character(np.vstack([points, bars]), np.vstack([triangles, more]), grown)
    whole = portrait(drawn(played(data)).head)
    assert np.linalg.norm(whole.position - alone.position) < 0.06


def test_a_mouth_that_moves_its_lips_alone_has_a_chin_below_them(face, played):
    points, triangles, _ = face
    shapes = strange_heads.arkit_shapes()
    lips = shapes["mouthLowerDownLeft"] + shapes["mouthLowerDownRight"]
    drawn_mouth = {"viseme_aa": 2 * lips, "Blink_L": shapes["eyeBlinkLeft"]}
    drawn_mouth["Blink_R"] = shapes["eyeBlinkRight"]
    alone = placement(
        played(strange_heads.character(points, triangles, drawn_mouth)).head.character
    )
    whole = placement(played(strange_heads.character(*face)).head.character)
    assert abs(alone[0, 0] / whole[0, 0] - 1) < 0.2


def png(*pixels, mode="RGBA"):
    image = Image.new(mode, (len(pixels), 1))
    image.putdata(list(pixels))
    image = image.resize((64 * len(pixels), 64), Image.Resampling.NEAREST)
    file = io.BytesIO()
    image.save(file, "PNG")
    return file.getvalue()


def cheek(motion, **options):
    """Red, green, blue, and alpha, of a cheek as it is drawn: most of it is one layer."""
    picture = {}
    for backend in ("moderngl", "embreex"):
        chosen = PictureOptions(background="transparent", backend=backend, **options)
        with open_pictures(motion.head, (96, 96), chosen) as renderer:
            picture[backend] = renderer.frame(motion.vertices(0, 1)[0]).astype(int)
    ours, theirs = picture.values()
    # Both engines draw the same, but for edges.
    assert np.median(np.abs(ours - theirs)) <= 1
    assert np.mean(np.abs(ours - theirs).max(axis=2) > 24) < 0.05
    near = ours[40:60, 34:44].reshape(-1, 4)
    most = np.bincount(near[:, 3]).argmax()
    return np.median(near[near[:, 3] == most], axis=0)


def test_unlit_materials_show_their_colour(face, played):
    seen = cheek(drawn(played(painted(face, [0.2, 0.5, 0.8, 1], **UNLIT))))
    wanted = 255 * to_srgb(np.array([[0.2, 0.5, 0.8]], np.float32))[0]
    assert np.abs(seen[:3] - wanted).max() <= 1 and seen[3] == 255


def test_a_picture_is_multiplied_by_the_factor_and_laid_by_its_transform(face, played):
    picture = png((255, 0, 0, 255), (0, 255, 0, 255))
    left = cheek(drawn(played(painted(face, [0.5, 1, 1, 1], picture=picture, **UNLIT))))
    assert np.abs(left[:3] - [255 * 0.5 ** (1 / 2.2), 0, 0]).max() <= 3
    shift = {"shift": {"offset": [0.5, 0.0]}}
    right = cheek(drawn(played(painted(face, [0.5, 1, 1, 1], picture=picture, **shift, **UNLIT))))
    assert np.abs(right[:3] - [0, 255, 0]).max() <= 1


@pytest.mark.parametrize(
    ("alpha", "record", "seen"),
    [
        (77, {"alphaMode": "MASK", "alphaCutoff": 0.2}, 255),
        (77, {"alphaMode": "MASK", "alphaCutoff": 0.4}, 0),
        (102, {"alphaMode": "BLEND"}, 102),
        (102, {"alphaMode": "OPAQUE"}, 255),
    ],
)
def test_alpha_is_meant_as_its_material_says(face, played, alpha, record, seen):
    picture = png((200, 200, 200, alpha), (200, 200, 200, alpha))
    shown = drawn(played(painted(face, [1, 1, 1, 1], picture=picture, **record, **UNLIT)))
    assert abs(cheek(shown)[3] - seen) <= 2


def test_a_material_that_blends_without_a_picture_is_clear(face, played):
    shown = drawn(played(painted(face, [1, 1, 1, 0.5], alphaMode="BLEND", **UNLIT)))
    assert abs(cheek(shown)[3] - 128) <= 2


@pytest.mark.parametrize("metal", [0.0, 1.0])
def test_metals_mirror_in_their_colour_in_both_engines(face, played, metal):
    lit = {"baseColorFactor": [0.9, 0.5, 0.1, 1], "metallicFactor": metal, "roughnessFactor": 0.4}
    seen = cheek(drawn(played(painted(face, [1, 1, 1, 1], pbrMetallicRoughness=lit))))
    assert seen[0] > seen[1] > seen[2] > 0


@pytest.mark.parametrize("version", [0, 1])
def test_mtoon_has_two_tones(face, played, version):
    """The shade's own colour where the face is turned from the key, at the head's left."""
    shade = [0.4, 0.1, 0.1]
    if version:
        toon = {"VRMC_materials_mtoon": {"shadeColorFactor": shade}}
        data = painted(face, [0.8, 0.8, 0.8, 1], extensions=toon)
    else:
        srgb = to_srgb(np.array([shade], np.float32))[0].tolist()
        given, binary = parts_of_glb(painted(face, [0.8, 0.8, 0.8, 1], **UNLIT))
        own = {"shader": "VRM/MToon", "vectorProperties": {"_ShadeColor": [*srgb, 1]}}
        given["extensions"] = {"VRM": {"materialProperties": [own]}}
        given["nodes"][0]["rotation"] = [0, 1, 0, 0]  # which looks along -Z
        data = glb(given, binary)
    shown = drawn(played(data))
    surface = shown.head.surfaces["own/Paint"]
    assert surface.shade is not None and np.allclose(
        surface.shade, np.array(shade) / 0.8, atol=0.02
    )
    with open_pictures(shown.head, (96, 96), PictureOptions(background="transparent")) as renderer:
        picture = renderer.frame(shown.vertices(0, 1)[0]).astype(int)
    colors = picture[picture[..., 3] == 255][:, :3]
    lit = 255 * to_srgb(np.full((1, 3), 0.8, np.float32))[0]
    assert (np.abs(colors - lit).max(axis=1) < 2).sum() > 500
    reddish = colors[:, 0] - colors[:, 1]
    assert (reddish > 45).sum() > 20
    deepest = 255 * to_srgb(np.array([shade], np.float32))[0]
    assert (colors.min(axis=0) >= deepest - 2).all()


def test_a_picture_that_is_not_read_is_told_and_the_factor_stays(face, played):
    data = painted(face, [0.2, 0.5, 0.8, 1], picture=b"\xabKTX 20\xbb\r\n\x1a\n", **UNLIT)
    with pytest.warns(ElocuteWarning, match=r"hero.glb: pictures packed as KTX2: left out"):
        shown = drawn(played(data))
    wanted = 255 * to_srgb(np.array([[0.2, 0.5, 0.8]], np.float32))[0]
    assert np.abs(cheek(shown)[:3] - wanted).max() <= 1


def test_damaged_and_swollen_pictures_are_refused(face, played):
    for picture, found in ((b"\x89PNG nothing", "no picture"), (_bomb(), "far too many|pixels in")):
        with pytest.raises(HeadError, match=found):
            drawn(played(painted(face, [1, 1, 1, 1], picture=picture)))


def _bomb() -> bytes:
    file = io.BytesIO()
    Image.new("1", (30_000, 30_000)).save(file, "PNG")
    return file.getvalue()


def test_numbers_that_are_none_are_an_error_of_one_line(face, played):
    points, triangles, shapes = face
    broken = points.copy()
    broken[5] = np.nan
    data = strange_heads.character(points, triangles, shapes)
    good, bad = points.astype("<f4").tobytes(), broken.astype("<f4").tobytes()
    with pytest.raises(HeadError, match=r"^hero.glb: numbers that are not finite"):
        drawn(played(data.replace(good, bad)))


def test_pictures_films_and_pages_are_written(face, played, speech_wav, tmp_path):
    motion = played(painted(face, [0.8, 0.6, 0.5, 1]))
    for suffix in ("png", "html"):
        write(motion, tmp_path / f"take.{suffix}")
        assert (tmp_path / f"take.{suffix}").stat().st_size > 10_000
    for quality in ("auto", "draft"):
        path = tmp_path / f"{quality}.mp4"
        write(motion, path, size=(64, 64), backend="embreex", quality=quality)
        assert path.stat().st_size > 1_000
    assert "jawOpen" in _shapes_of_page(tmp_path / "take.html")


def _shapes_of_page(page):
    found = re.search(r'id="head"[^>]*>([^<]+)<', page.read_text())
    assert found
    data = base64.b64decode(found.group(1))
    data = gzip.decompress(data) if data[:2] == b"\x1f\x8b" else data
    return parts_of_glb(data)[0]["meshes"][0]["extras"]["targetNames"]
