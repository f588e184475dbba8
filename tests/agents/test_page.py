"""What docs/use/agents.md says to type: its Python speaks, and its JavaScript draws."""

# pyright: reportMissingImports=false

from __future__ import annotations

import asyncio
import json
import subprocess
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import elocute
from elocute.animation import animate
from elocute.export.registry import write
from elocute.live.json_lines import frame_record
from elocute.live.live_frame import SHAPES, LiveFrame
from elocute.motion.curves import ARKIT_NAMES
from tests.support.documented_pages import BLOCKS
from tests.support.three_js import MODULES, bundled, node_program

PAGE = "docs/use/agents.md"
RATE = 24000
TURN = {"yaw": 20.0, "pitch": -10.0, "roll": 5.0}
SKELETON = [
    ["Hips", None, [0, 0, 0], [np.pi / 2, 0, 0]],
    ["Neck", 0, [0, 1.4, 0], [0.3, 0, 0.2]],
    ["Head", 1, [0, 0.1, 0], [-0.2, 0.4, 0]],
]
DRAWN = """
import * as THREE from "three";
import { readFileSync } from "node:fs";
import { GLTFLoader } from "three/examples/jsm/loaders/GLTFLoader.js";
import { VRMLoaderPlugin } from "@pixiv/three-vrm";
%s
const [file, message] = JSON.parse(process.argv[2]);
const loader = new GLTFLoader();
loader.register((parser) => new VRMLoaderPlugin(parser));
const { buffer, byteOffset, length } = readFileSync(file);
const of = (head) => head.getWorldQuaternion(new THREE.Quaternion());
const bytes = buffer.slice(byteOffset, byteOffset + length);
loader.parseAsync(bytes, "").then(({ scene, userData: { vrm } }) => {
  scene.updateMatrixWorld(true);
  const head = vrm ? vrm.humanoid.getNormalizedBoneNode("head") : scene.getObjectByName("Head");
  const rest = of(head);
  const show = vrm ? faceOfVrm(vrm) : faceOf(scene, head);
  show({ ...message, type: "another", curves: {}, head_deg: { yaw: 90, pitch: 0, roll: 0 } });
  show(message);
  show(message);  // twice is once
  scene.updateMatrixWorld(true);
  const values = {};
  if (vrm) for (const { expressionName } of vrm.expressionManager.expressions)
    values[expressionName] = vrm.expressionManager.getValue(expressionName);
  else scene.traverse(({ morphTargetDictionary: names, morphTargetInfluences: weights }) => {
    for (const name in names ?? {}) values[name] = weights[names[name]];
  });
  console.log(JSON.stringify({ values, turn: of(head).multiply(rest.invert()).toArray() }));
});
"""


def code_of(kind: str, word: str) -> str:
    """The block of the page with a word."""
    (found,) = [b.text for b in BLOCKS if b.page == PAGE and b.kind == kind and word in b.text]
    return found


@pytest.fixture(scope="module")
def open_mouth(speech_wav: Path) -> LiveFrame:
    """The frame of a second of speech whose jaw is lowest."""
    samples = elocute.read_audio(speech_wav, sample_rate=16000).samples[:16000]
    frames = list(elocute.stream(16000, fps=30, lookahead=0.25).push(samples))
    return max(
        (LiveFrame(0, 30, frame) for frame in frames), key=lambda frame: frame.arkit["jawOpen"]
    )


@pytest.fixture(scope="module")
def show(need: Callable, tmp_path_factory: pytest.TempPathFactory) -> Callable[..., Any]:
    """What the page's JavaScript makes of a message, for the avatar in a file."""
    node = node_program(need)
    need((MODULES / "@pixiv" / "three-vrm").is_dir(), "three-vrm in web/node_modules (npm ci)")
    program = tmp_path_factory.mktemp("draw") / "draw.cjs"
    blocks = code_of("js", "faceOf(avatar") + code_of("js", "faceOfVrm")
    program.write_text(bundled(DRAWN % blocks, platform="node"))

    def shown(file: Path, frame: LiveFrame, shapes: str) -> dict[str, Any]:
        record = frame_record(frame, SHAPES[shapes].values(frame))
        message = {"type": "elocute-face", **record, "head_deg": TURN}
        words = [node, program, json.dumps([str(file), message])]
        told = json.loads(subprocess.run(words, check=True, capture_output=True, text=True).stdout)
        assert told["turn"] == pytest.approx(turned(), abs=1e-5)
        return told["values"]

    return shown


def turned() -> list[float]:
    """The turn xyzw of the head in the world: to its own left, chin up, to its own right."""
    axis = np.radians([TURN["pitch"], TURN["yaw"], TURN["roll"]])
    half = np.linalg.norm(axis) / 2
    return [*(np.sin(half) * axis / np.linalg.norm(axis)), np.cos(half)]


@pytest.mark.system
def test_an_avatar_of_three_js_has_the_curves(
    need: Callable, show: Callable, open_mouth: LiveFrame, tmp_path: Path
) -> None:
    program, avatar = tmp_path / "make.cjs", tmp_path / "avatar.glb"
    source = Path(__file__).parents[1] / "support" / "make_character.js"
    program.write_text(bundled(source.read_text(), platform="node"))
    head = {"name": "Skin", "targets": list(ARKIT_NAMES), "rest": {}, "place": [0, 1.6, 0]}
    spec = {"meshes": [head], "bones": SKELETON, "trs": False, "scene_turn": [-np.pi / 2, 0, 0]}
    words = [node_program(need), program, json.dumps({**spec, "out": str(avatar)})]
    subprocess.run(words, check=True, capture_output=True)
    values = show(avatar, open_mouth, "arkit")
    assert values["jawOpen"] > 0.15
    assert values == pytest.approx(open_mouth.arkit, abs=1e-4)


@pytest.mark.system
def test_an_avatar_of_vrm_has_the_expressions(
    show: Callable, open_mouth: LiveFrame, speech_wav: Path, tmp_path: Path
) -> None:
    take = animate(speech_wav, fps=5, look="none")
    write(take.motion, tmp_path / "avatar.vrm")
    values = show(tmp_path / "avatar.vrm", open_mouth, "vrm")
    presets = {name: values[name] for name in open_mouth.vrm}
    assert max(presets[name] for name in ("aa", "ih", "ou", "ee", "oh")) > 0.1
    assert presets == pytest.approx(open_mouth.vrm, abs=1e-4)


@pytest.fixture(scope="module")
def chunks(speech_wav: Path) -> list[bytes]:
    """A second of speech in pieces, as a voice gives them."""
    samples = elocute.read_audio(speech_wav, sample_rate=RATE).samples[:RATE]
    pcm = (samples * 32767).astype(np.int16).tobytes()
    return [pcm[at : at + 4800] for at in range(0, len(pcm), 4800)]


def page_of(word: str, **names: Any) -> dict[str, Any]:
    """The names that the page's Python with a word defines."""
    exec(code_of("python", word), names)
    return names


def test_frames_come_from_a_stream(chunks: list[bytes]) -> None:
    blocks = [np.frombuffer(chunk, np.int16) for chunk in chunks]
    page = page_of("elocute.stream", blocks=blocks)
    assert page["frame"].time_s > 0.2 and page["frame"]["jawOpen"] >= 0


def test_parts_come_for_talkinghead(chunks: list[bytes]) -> None:
    parts = list(page_of("talkinghead_parts")["speech"](chunks))
    assert set(parts[0]) == {"audio", "anims"} and len(parts) > 3


def test_pipecat_s_pipeline_has_a_face(chunks: list[bytes]) -> None:
    pytest.importorskip(
        "pipecat", reason="pipecat-ai is missing: `scripts/matrix.py agents` has it"
    )
    from pipecat.frames.frames import TTSAudioRawFrame
    from pipecat.processors.filters.identity_filter import IdentityFilter
    from pipecat.processors.frameworks.rtvi import RTVIServerMessageFrame
    from pipecat.tests.utils import run_test

    class Transport:
        input = output = IdentityFilter

    others = [IdentityFilter() for _ in range(3)]
    pipeline = page_of("FaceProcessor")["with_face"](Transport(), *others)
    voice = [TTSAudioRawFrame(chunk, RATE, 1) for chunk in chunks]
    down, _ = asyncio.run(run_test(pipeline, frames_to_send=voice))
    told = [frame.data for frame in down if isinstance(frame, RTVIServerMessageFrame)]
    assert sum(isinstance(frame, TTSAudioRawFrame) for frame in down) == len(chunks)
    assert len(told) > 20
    example = json.loads(code_of("json", "elocute-face"))
    assert set(told[0]) == set(example) and set(told[0]["head_deg"]) == set(example["head_deg"])


def test_livekit_s_session_has_a_face(chunks: list[bytes]) -> None:
    pytest.importorskip(
        "livekit", reason="livekit-agents is missing: `scripts/matrix.py agents` has it"
    )
    from livekit import rtc

    from tests.agents.test_livekit import Room

    class Session:
        output: Any

    Session.output = Session()

    async def speak() -> Room:
        room, session = Room(), Session()
        runner = await page_of("FaceGenerator")["add_face"](session, room)
        ended = asyncio.Event()
        session.output.audio.on("playback_finished", lambda _: ended.set())
        for chunk in chunks:
            frame = rtc.AudioFrame(chunk, RATE, 1, len(chunk) // 2)
            await session.output.audio.capture_frame(frame)
        session.output.audio.flush()
        await asyncio.wait_for(ended.wait(), 60)
        await runner.aclose()
        return room

    assert len(asyncio.run(speak()).packets) > 20
