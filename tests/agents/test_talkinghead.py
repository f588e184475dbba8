"""TalkingHead itself, in a real browser, speaks with our curves."""

from __future__ import annotations

import base64
import json
import shutil
import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import elocute
from elocute.agents import talkinghead_parts
from elocute.live.live_frame import LiveFrame
from elocute.motion.curves import ARKIT_NAMES
from tests.support.browser import eventually, headless_browser
from tests.support.gltf_files import OCULUS
from tests.support.three_js import MODULES, bundled, node_program

RATE = 24000
EXAMPLE = Path(__file__).parents[2] / "examples" / "talkinghead"
FINGERS = [
    f"{finger}{joint}"
    for finger in ("Thumb", "Index", "Middle", "Ring", "Pinky")
    for joint in "123"
]


@pytest.fixture(scope="module")
def pcm(speech_wav: Path) -> bytes:
    samples = elocute.read_audio(speech_wav, sample_rate=RATE).samples[: 2 * RATE]
    return (samples * 32767).astype("<i2").tobytes()


@pytest.fixture(scope="module")
def parts(pcm: bytes) -> list[dict[str, Any]]:
    """Speech in chunks that end in the middle of a sample."""
    return list(talkinghead_parts([pcm[at : at + 7001] for at in range(0, len(pcm), 7001)], RATE))


@pytest.fixture(scope="module")
def frames(pcm: bytes) -> list[LiveFrame]:
    live = elocute.stream(RATE, fps=30, lookahead=0.25)
    given = [*live.push(np.frombuffer(pcm, "<i2")), *live.flush()]
    return [LiveFrame(number, 30, frame) for number, frame in enumerate(given)]


def test_each_part_has_the_sound_of_its_curves(parts: list[dict[str, Any]], pcm: bytes) -> None:
    sounds = [base64.b64decode(part["audio"]) for part in parts]
    assert b"".join(sounds) == pcm
    before_s = 0.0
    for part, sound in zip(parts, sounds, strict=True):
        (anim,) = part["anims"]
        assert anim["delay"] + anim["dt"][0] == pytest.approx(1000 * before_s, abs=0.1)
        before_s += len(sound) / 2 / RATE
        assert before_s - anim["delay"] / 1000 - sum(anim["dt"]) / 1000 < 0.04


def test_curves_are_those_of_a_stream(parts: list[dict[str, Any]], frames: list[LiveFrame]) -> None:
    anims = [part["anims"][0] for part in parts]
    names = list(anims[0]["vs"])
    assert len(names) == 42 and not [name for name in names if name.startswith("eyeLook")]
    for name in names:
        values = [value for anim in anims for value in anim["vs"][name]]
        assert values == pytest.approx([frame.arkit[name] for frame in frames], abs=6e-4)


SIDES = [
    [f"{side}{part}" for part in limb.split()]
    for side in ("Left", "Right")
    for limb in (
        "Shoulder Arm ForeArm Hand",
        "UpLeg Leg Foot ToeBase",
        *(f"Hand{finger}" for finger in FINGERS),
    )
]


def bones() -> list[list[Any]]:
    """Mixamo's skeleton: name, number of the parent, place and turn of each bone."""
    made: list[list[Any]] = []

    def add(names: list[str], parent: str | None) -> None:
        for name in names:
            known = [bone[0] for bone in made]
            number = None if parent is None else known.index(parent)
            made.append([name, number, [0, 0.1 if parent else 0.9, 0], [0, 0, 0]])
            parent = name

    add(["Hips", "Spine", "Spine1", "Spine2", "Neck", "Head", "LeftEye"], None)
    add(["RightEye"], "Head")
    for limb in SIDES:
        upper = {"Shoulder": "Spine2", "UpLeg": "Hips"}
        side = "Left" if limb[0].startswith("Left") else "Right"
        add(limb, upper.get(limb[0].removeprefix(side), f"{side}Hand"))
    return made


@pytest.fixture(scope="module")
def page(
    need: Callable, pcm: bytes, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[tuple[Any, Path]]:
    """The example with an avatar of ARKit's shapes, in a browser."""
    node = node_program(need)
    need((MODULES / "@met4citizen").is_dir(), "TalkingHead in web/node_modules (npm ci)")
    folder = tmp_path_factory.mktemp("talkinghead")
    program = folder / "make.cjs"
    source = Path(__file__).parents[1] / "support" / "make_character.js"
    program.write_text(bundled(source.read_text(), platform="node"))
    visemes = [f"viseme_{name.removeprefix('viseme_')}" for name in OCULUS]
    targets = [*ARKIT_NAMES, *visemes]
    head = {"name": "Head_Mesh", "targets": targets, "rest": {}, "place": [0, 1.6, 0]}
    avatar = folder / "avatar.glb"
    spec = {"meshes": [head], "bones": bones(), "trs": False, "out": str(avatar)}
    spec["scene_turn"] = [0, 0, 0]
    subprocess.run([node, program, json.dumps(spec)], check=True, capture_output=True)
    for name in ("serve.py", "index.html"):
        shutil.copy(EXAMPLE / name, folder)
    (folder / "node_modules").symlink_to(MODULES.resolve(), target_is_directory=True)
    import soundfile

    soundfile.write(folder / "speech.wav", np.frombuffer(pcm, "<i2"), RATE)
    command = [sys.executable, "serve.py", avatar.name, "speech.wav", "--port", "0"]
    with subprocess.Popen(command, cwd=folder, stdout=subprocess.PIPE, text=True) as server:
        assert server.stdout is not None
        address = server.stdout.readline().strip()
        try:
            with headless_browser(need, folder / "profile") as driver:
                driver.get(address)
                yield driver, folder
        finally:
            server.terminate()


@pytest.mark.slow
@pytest.mark.browser
@pytest.mark.system
def test_an_avatar_of_talkinghead_speaks(page: tuple[Any, Path], frames: list[LiveFrame]) -> None:
    driver, _ = page
    ready = "return !document.querySelector('button').disabled"
    assert eventually(lambda: driver.execute_script(ready)), driver.get_log("browser")
    driver.execute_script("""
        // All of the speech at once, since a busy machine may be slower than a voice.
        const real = fetch;
        window.fetch = async (...given) => new Response(await (await real(...given)).text());
        window.seen = [];
        const jaw = () => head.mtAvatar.jawOpen;
        const look = () => {
          if (head.isSpeaking && head.streamAudioStartTime)
            seen.push([(head.animClock - head.streamAudioStartTime) / 1000, jaw().applied]);
          requestAnimationFrame(look);
        };
        look();
        document.querySelector('button').click();
    """)
    assert eventually(lambda: len(driver.execute_script("return seen")) > 5)
    assert eventually(lambda: driver.execute_script(ready)), driver.get_log("browser")
    seen = np.array(driver.execute_script("return seen"))
    jaws = [frame.arkit["jawOpen"] for frame in frames]
    wanted = np.interp(seen[:, 0], np.arange(len(frames)) / 30, jaws)
    assert seen[:, 1].max() > 0.15 and np.corrcoef(seen[:, 1], wanted)[0, 1] > 0.95
    # A tenth of a second earlier or later it would be another mouth.
    for late_s in (-0.1, 0.1):
        other = np.interp(seen[:, 0] + late_s, np.arange(len(frames)) / 30, jaws)
        assert np.corrcoef(seen[:, 1], other)[0, 1] < 0.9
