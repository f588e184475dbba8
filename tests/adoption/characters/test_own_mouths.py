"""Characters whose shapes do something else than ours: what their own lips do on their own mesh."""

from dataclasses import replace

import numpy as np
import pytest

from elocute.adoption.characters.open_character import character_head, character_of
from elocute.adoption.flame_places import FLAME_LANDMARKS
from elocute.animation import animate
from elocute.errors import HeadError
from elocute.export.character_weights import character_motion, measured_mouth
from elocute.export.drawn_character import drawn
from elocute.head.builtin import load_builtin_head
from elocute.head.viseme_shapes import VISEME_SHAPES
from elocute.meshes.gltf_document import gltf_document
from elocute.motion.control_fit import builtin_mouth, fit_controls
from elocute.motion.mouth_measures import measure_mouth
from elocute.motion.mouth_seam import SHARES, find_mouth
from elocute.numerics.quaternions import from_axis_angle, no_turn, to_matrices
from tests.support.gltf_files import glb, parts_of_glb
from tests.support.strange_heads import (
    VISEMES,
    arkit_shapes,
    character,
    drawn_face,
    face,
    rigged,
    viseme_shapes,
)

UPPER, LOWER = FLAME_LANDMARKS[62], FLAME_LANDMARKS[66]
OCULUS_NAMES = {"ih": "I", "oh": "O", "ou": "U"}


@pytest.fixture(scope="module")
def take(speech_wav):
    spoken = animate(speech_wav, fps=30, look="none", life=0).motion
    return replace(spoken, weights=spoken.weights[110:240], rotations=None)


@pytest.fixture
def opened(tmp_path):
    def make(data):
        path = tmp_path / "face.glb"
        document = gltf_document(data, "face.glb", error=HeadError)
        return character_of(document, path, None, {}).character

    return make


def oculus(opening):
    shapes = viseme_shapes(opening)
    return {f"viseme_{OCULUS_NAMES.get(name, name)}": shapes[name] for name in VISEMES}


def vowels(opening):
    shapes = viseme_shapes(opening)
    return dict(zip("AIUEO", (shapes[n] for n in ("aa", "ih", "ou", "E", "oh")), strict=True))


def weights_by_shape(motion, face):
    """(frame,) of each morph target by its name."""
    (mesh,) = face.meshes
    names = face.document.records("meshes")[mesh]["extras"]["targetNames"]
    (table,) = character_motion(motion, face).weights.values()
    return dict(zip(names, table.T, strict=True))


def gap_mm(points, shapes, weights):
    """(frame,) between the middles of the inner lips, as the landmarks of the mesh name them."""
    rest = points[UPPER, 1] - points[LOWER, 1]
    moved = [weights[name] * (shape[UPPER] - shape[LOWER])[1] for name, shape in shapes.items()]
    return 1000 * (rest + np.sum(moved, axis=0))


def sealed(motion):
    """(frame,) where lips are shut for a p, b or m."""
    over, jaw = (motion.weights[:, motion.names.index(n)] for n in ("mouthClose", "jawOpen"))
    press = motion.weights[:, motion.names.index("mouthPressLeft")]
    return (press > 0.495) & (over > jaw - 0.01)


@pytest.mark.parametrize(
    "shapes",
    [arkit_shapes(1.6, 0.85), arkit_shapes(0.6, 1.2), oculus(1.5), vowels(1.5), vowels(0.8)],
    ids=["wide jaw, weak close", "small jaw, strong close", "Oculus", "VRM, wide", "VRM, small"],
)
def test_lips_open_as_far_as_the_takes_and_meet(take, opened, shapes):
    points, triangles = face()
    weights = weights_by_shape(take, opened(character(points, triangles, shapes)))
    gap, wanted = gap_mm(points, shapes, weights), measure_mouth(take)["opening_mm"]
    opens = wanted > 2
    size = (gap * wanted)[opens].sum() / np.square(wanted[opens]).sum()
    assert np.corrcoef(np.maximum(gap, 0), wanted)[0, 1] > 0.97
    assert 0.9 < size < 1.12  # the middle of a round mouth opens further than its middle third
    assert sealed(take).sum() > 10 and gap[sealed(take)].max() < 0.3
    if "jawOpen" not in shapes:
        assert np.sum([*weights.values()], axis=0).max() <= 1 + 1e-6


@pytest.mark.parametrize("jaw", [0.6, 1.6])
def test_a_jaw_of_another_reach_drops_as_far(take, opened, jaw):
    points, triangles = face()
    shapes = arkit_shapes(jaw)
    weights = weights_by_shape(take, opened(character(points, triangles, shapes)))
    chin = FLAME_LANDMARKS[8]
    drop = 1000 * -sum(weights[name] * shape[chin, 1] for name, shape in shapes.items())
    wanted = measure_mouth(take)["jaw_mm"]
    assert (drop * wanted).sum() / np.square(wanted).sum() == pytest.approx(1, abs=0.1)
    brows = take.weights[:, take.names.index("browInnerUp")]
    assert np.array_equal(weights["browInnerUp"], brows)  # only the mouth is corrected


def test_shapes_like_ours_keep_the_curves(take, opened):
    points, triangles = face()
    weights = weights_by_shape(take, opened(character(points, triangles, arkit_shapes())))
    for name in ("jawOpen", "mouthClose", "mouthPucker", "mouthSmileLeft"):
        assert np.abs(weights[name] - take.weights[:, take.names.index(name)]).max() < 0.15


def small_mouth(**changes):
    points, triangles, shapes = drawn_face()
    return character(points, triangles, {f"Fcl_MTH_{n}": s for n, s in shapes.items()}, **changes)


def test_a_drawn_mouth_does_not_hang_below_the_chin(take, opened):
    points, _, shapes = drawn_face()
    weights = weights_by_shape(take, opened(small_mouth()))
    wanted = measure_mouth(take)["opening_mm"]
    middle = np.abs(points[:, 0]) < 1e-9
    edge = np.flatnonzero(middle & np.isclose(points[:, 1], -0.045))
    upper, lower = edge[0], edge[-1]
    moved = [weights[f"Fcl_MTH_{n}"] * (s[upper] - s[lower])[1] for n, s in shapes.items()]
    gap = 1000 * np.sum(moved, axis=0)
    # Its mouth is 30 mm wide, ours 43 between the same places: A in full would be 25 mm.
    assert gap.max() == pytest.approx(30 / 43 * wanted.max(), rel=0.15)
    assert gap[sealed(take)].max() < 0.1
    assert np.sum([*weights.values()], axis=0).max() <= 1 + 1e-6
    assert weights["Fcl_MTH_Close"][sealed(take)].min() > 0.95


def test_a_mouth_is_found_wherever_the_face_looks_and_in_any_unit(opened):
    """A VRM 0 looks along -Z; the armature above the skin is in centimetres."""
    half = np.sqrt(0.5)
    bones = [{"bone": "head", "node": 2}]
    groups = [
        {"presetName": name, "binds": [{"mesh": 0, "index": place, "weight": 100}]}
        for place, name in enumerate("aiueo")
    ]
    turned = small_mouth(
        nodes=[
            {"name": "Face", "mesh": 0, "rotation": [0, 1, 0, 0]},
            {"name": "Root", "children": [0, 2], "scale": [100, 100, 100]},
            {"name": "Head", "rotation": [half, 0, 0, half]},
        ],
        scenes=[{"nodes": [1]}],
        extensions={
            "VRM": {
                "blendShapeMaster": {"blendShapeGroups": groups},
                "humanoid": {"humanBones": bones},
            }
        },
    )
    plain, other = opened(small_mouth()), opened(turned)
    assert other.facing_deg == 180
    mouths = [measured_mouth(each) for each in (plain, other)]
    assert mouths[0] is not None and mouths[1] is not None
    assert mouths[1].width == pytest.approx(100 * mouths[0].width, rel=1e-3)
    assert mouths[0].width == pytest.approx(0.03, rel=0.2)
    # A alone: 25 mm, in the middle.
    by_name = dict(zip((c.name for c in plain.controls), mouths[0].effects, strict=True))
    assert by_name["Fcl_MTH_A"][len(SHARES) // 2] == pytest.approx(0.025, rel=0.05)


def turned(face, *angles):
    """Points, triangles and shapes of a face, turned about each axis in turn."""
    points, triangles, shapes = face
    turn = to_matrices(from_axis_angle(np.array(angles))).astype(float).T
    return points @ turn, triangles, {name: shape @ turn for name, shape in shapes.items()}


@pytest.mark.parametrize(
    ("angles", "facing", "tilt"),
    [
        ((0, 0, 0), 0, 0),
        ((0, np.pi, 0), 180, 0),
        ((0, -np.pi / 2, 0), -90, 0),
        ((0, 0.8, 0), np.degrees(0.8), 0),
        ((np.pi / 2, 0, 0), 0, 90),  # as Blender has it, where Z is up
    ],
)
def test_a_face_without_eyes_looks_where_its_mouth_is(opened, angles, facing, tilt):
    plain = (*face(), arkit_shapes())
    found = opened(character(*turned(plain, *angles)))
    assert (found.facing_deg, found.tilt_deg) == (pytest.approx(facing, abs=3), tilt)
    assert found.notes == ()
    mouth, wanted = measured_mouth(found), measured_mouth(opened(character(*plain)))
    assert mouth is not None and wanted is not None
    assert np.allclose(mouth.effects, wanted.effects, atol=1e-3)


def test_any_shapes_of_a_face_tell_its_front(opened):
    shapes = {name: shape for name, shape in arkit_shapes().items() if name != "jawOpen"}
    assert opened(character(*turned((*face(), shapes), 0, np.pi, 0))).facing_deg == 180


def test_a_mouth_that_is_a_mesh_of_its_own_is_ahead_of_the_head(opened):
    points, triangles, shapes = turned((*face(), arkit_shapes()), 0, np.pi, 0)
    lips = np.linalg.norm(shapes["mouthPucker"], axis=1) > 0.004
    apart = np.argsort(~lips[triangles].all(axis=1), kind="stable")
    given, binary = parts_of_glb(character(points, triangles[apart], shapes))
    count = 3 * int(lips[triangles].all(axis=1).sum())
    given["accessors"].append(given["accessors"][1] | {"count": count})
    mouth = given["meshes"][0]["primitives"][0]
    given["meshes"].append({"primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]})
    mouth["indices"] = len(given["accessors"]) - 1
    given["nodes"].append({"name": "Skull", "mesh": 1})
    given["scenes"] = [{"nodes": [0, 1]}]
    assert opened(glb(given, binary)).facing_deg == 180


def rigged_without_eyes(face):
    given, binary = parts_of_glb(rigged(face, turn=(0, np.pi, 0)))
    for node in given["nodes"][3:]:
        node["name"] = "helper"
    return glb(given, binary)


def test_a_head_without_eyes_nods_where_it_looks(take, opened):
    plain = (*face(), arkit_shapes())
    turning = replace(take, rotations=no_turn(take.frame_count, 5).astype(np.float32))
    turning.rotations[:, 1] = from_axis_angle(np.array([0.2, 0.1, 0]))
    faces = [opened(rigged(plain, turn=(0, np.pi, 0))), opened(rigged_without_eyes(plain))]
    assert [each.facing_deg for each in faces] == [180, 180]
    by_eyes, by_mouth = (character_motion(turning, each).turns for each in faces)
    assert np.array_equal(by_eyes[1], by_mouth[1])


def test_a_face_that_shows_no_front_is_told(opened):
    points, triangles, shapes = drawn_face()
    flat = points * [1, 1, 0], triangles, {f"Fcl_MTH_{n}": s for n, s in shapes.items()}
    found = opened(rigged_without_eyes(flat))
    (note,) = found.notes
    assert note.startswith("face.glb: neither joints of eyes nor shapes tell which way its face")
    assert found.facing_deg == 0 and opened(rigged(flat)).notes == ()


def test_a_mouth_is_found_beside_a_primitive_that_stays(take, opened):
    given, binary = parts_of_glb(small_mouth())
    (speaks,) = given["meshes"][0]["primitives"]
    given["accessors"].append(given["accessors"][1] | {"count": 3})  # a triangle of the forehead
    still = {"attributes": {"POSITION": 0}, "indices": len(given["accessors"]) - 1}
    given["meshes"][0]["primitives"] = [still, speaks]
    face = opened(glb(given, binary))
    mouth, alone = (measured_mouth(each) for each in (face, opened(small_mouth())))
    assert mouth is not None and alone is not None
    assert np.allclose(mouth.effects, alone.effects)
    shown = [replace(take, head=character_head(each)) for each in (face, opened(small_mouth()))]
    moves, wanted = (np.abs(drawn(each).head.expression_basis).max() for each in shown)
    assert moves == pytest.approx(wanted, rel=1e-3) and wanted > 0.001


def test_a_sheet_without_a_slit_has_no_mouth():
    points, triangles, shapes = drawn_face()
    joined, place = np.unique(points.round(9), axis=0, return_inverse=True)
    drop = np.exp(-np.square((joined[:, 1] + 0.06) / 0.02)) * 0.02

    def moved(used):
        return np.zeros((1, len(used), 3))

    assert find_mouth(joined, place.ravel()[triangles], drop, moved) is None
    assert find_mouth(points, triangles, -shapes["A"][:, 1], moved) is not None
    assert find_mouth(points, triangles, np.zeros(len(points)), moved) is None


def test_the_built_in_mouth_is_where_its_lips_are():
    head = load_builtin_head()
    mouth = builtin_mouth(("jawOpen", "mouthClose", "mouthPucker"))
    assert mouth.width == pytest.approx(np.ptp(head.template[head.inner_corners, 0]), rel=0.05)
    assert mouth.gaps.max() < 1e-4  # they touch
    opened, closed, rounded = mouth.effects
    middle = len(SHARES) // 2
    lips = head.inner_lip_upper[6], head.inner_lip_lower[6]
    jaw = head.expression_basis[head.expression_index("jawOpen")]
    assert opened[middle] == pytest.approx(jaw[lips[0], 1] - jaw[lips[1], 1], rel=0.02)
    assert opened[:-2] + closed[:-2] == pytest.approx(0, abs=1e-3)
    assert rounded[-2] < -0.02 and opened[-1] > 0.015


def test_vertices_that_cannot_be_read_leave_the_names(take, opened):
    """What is damaged or packed in a way that is not read speaks as the names say."""
    points, triangles = face()
    good = opened(character(points, triangles, arkit_shapes(1.6)))
    text = good.document.text.replace('"indices": 1', '"indices": 0')
    broken = replace(good, document=gltf_document(_with_text(good, text), "x", error=HeadError))
    assert measured_mouth(good) is not None
    assert measured_mouth(broken) is None
    kept = weights_by_shape(take, broken)["jawOpen"]
    assert np.array_equal(kept, take.weights[:, take.names.index("jawOpen")])


def _with_text(face, text):
    return glb(text, bytes(face.document.binary))


def test_lips_that_part_over_closed_teeth_are_no_seal(take):
    """For an s the lower lip is down while `mouthClose` holds the jaw's share back."""
    sealed, parted = np.zeros((2, len(take.names)), np.float32)
    for name in ("jawOpen", "mouthClose"):
        sealed[take.names.index(name)] = parted[take.names.index(name)] = 0.2
    for side in ("Left", "Right"):
        parted[take.names.index(f"mouthLowerDown{side}")] = 0.3
    motion = replace(take, weights=np.stack([sealed, parted]))
    assert measure_mouth(motion)["opening_mm"] == pytest.approx([0, 3], abs=0.7)
    fit = fit_controls(motion, [VISEME_SHAPES["PP"], VISEME_SHAPES["SS"]])
    assert fit.weights[0] == pytest.approx([1, 0], abs=1e-3) and fit.weights[1, 0] < 0.2
    assert fit.weights[1, 1] > 0.5
