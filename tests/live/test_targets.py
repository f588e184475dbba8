"""Frames as other programs receive them: decoded by their own rules, and by other people's code."""

from __future__ import annotations

import csv
import json
import struct
from dataclasses import replace

import numpy as np
import pytest
from pythonosc.osc_bundle import OscBundle

import elocute
from elocute.errors import InputError
from elocute.export.arkit_csv import COLUMNS, write_csv
from elocute.live.live_frame import LiveFrame
from elocute.live.targets import TARGETS, Access, open_outputs
from elocute.motion.curves import ARKIT_NAMES
from elocute.numerics.quaternions import from_axis_angle


@pytest.fixture(scope="module")
def frames(speech_wav) -> list[LiveFrame]:
    """A second and a half of speech."""
    sound = elocute.read_audio(speech_wav, sample_rate=16000).samples[:24000]
    stream = elocute.stream(16000, lookahead=0.3)
    given = [*stream.push(sound), *stream.flush()]
    return [LiveFrame(number, 60.0, frame) for number, frame in enumerate(given)]


@pytest.fixture(scope="module")
def open_mouth(frames: list[LiveFrame]) -> LiveFrame:
    """The frame whose jaw is lowest, with a head that is turned to its own left."""
    widest = max(frames, key=lambda frame: frame.arkit["jawOpen"])
    rotations = widest.frame.rotations.copy()
    names = widest.motion.head.joint_names
    rotations[:] = [1, 0, 0, 0]
    rotations[names.index("head")] = from_axis_angle(np.array([0.0, np.radians(20), 0.0]))
    return replace(widest, frame=replace(widest.frame, rotations=rotations))


def osc_messages(packets: list[bytes]) -> list[tuple[str, list]]:
    assert all(len(packet) <= 1500 for packet in packets)
    found = [content for packet in packets for content in OscBundle(packet)]
    return [(each.address, list(each.params)) for each in found]


@pytest.mark.parametrize(
    ("name", "jaw"), [("vmc", "A"), ("vmc-vrm1", "aa"), ("vmc-arkit", "JawOpen")]
)
def test_vmc_is_read_by_python_osc(open_mouth: LiveFrame, name: str, jaw: str) -> None:
    messages = osc_messages(TARGETS[name].open_encoder().packets(open_mouth))
    values = {params[0]: params[1] for address, params in messages if address.endswith("Blend/Val")}
    assert messages[0] == ("/VMC/Ext/OK", [1]) and messages[-1] == ("/VMC/Ext/Blend/Apply", [])
    assert all(0 <= value <= 1 for value in values.values()) and values[jaw] > 0.1
    wanted = open_mouth.arkit if name == "vmc-arkit" else open_mouth.vrm
    assert list(values.values()) == pytest.approx(list(wanted.values()), abs=1e-6)
    bones = {params[0]: params[1:] for address, params in messages if address.endswith("Bone/Pos")}
    # To its own left is a turn to the left in Unity, too: about -y, where x points to the right.
    assert bones["Head"] == pytest.approx(
        [0, 0, 0, 0, -np.sin(np.radians(10)), 0, np.cos(np.radians(10))]
    )
    assert bones["Neck"] == [0, 0, 0, 0, 0, 0, 1]


def test_plain_osc_has_a_message_for_each_curve(open_mouth: LiveFrame) -> None:
    messages = dict(osc_messages(TARGETS["osc"].open_encoder().packets(open_mouth)))
    assert messages["/elocute/frame"] == pytest.approx(
        [open_mouth.number, open_mouth.frame.time_s], abs=1e-6
    )
    assert messages["/elocute/head"] == pytest.approx([20, 0, 0], abs=1e-4)
    for name in COLUMNS:
        assert messages[f"/elocute/{name}"] == pytest.approx([open_mouth.arkit[name]], abs=1e-6)
    assert len(messages) == 54


def test_live_link_face_holds_what_its_recordings_hold(open_mouth: LiveFrame, tmp_path) -> None:
    (packet,) = TARGETS["livelink"].open_encoder().packets(open_mouth)
    version, length = struct.unpack(">Bi", packet[:5])
    assert version == 6 and length == 36 and packet[5:41].decode().count("-") == 4
    (named,) = struct.unpack(">i", packet[41:45])
    assert packet[45 : 45 + named] == b"Elocute"
    times = struct.unpack(">ifiiB", packet[45 + named : 62 + named])
    assert times == (open_mouth.number, 0.0, 60, 1, 61)
    values = struct.unpack(">61f", packet[62 + named :])
    write_csv(open_mouth.motion, tmp_path / "take.csv")
    text = (tmp_path / "take.csv").read_text(encoding="utf-8")
    (row,) = csv.DictReader(text.splitlines())
    assert list(values) == pytest.approx([float(cell) for cell in list(row.values())[2:]], abs=1e-6)
    assert values[52] == pytest.approx(20 / 180)  # HeadYaw


@pytest.mark.parametrize(("fps", "rate"), [(30000 / 1001, (30000, 1001)), (24.0, (24, 1))])
def test_live_link_face_has_exact_rates(open_mouth: LiveFrame, fps: float, rate) -> None:
    (packet,) = TARGETS["livelink"].open_encoder().packets(replace(open_mouth, fps=fps))
    assert struct.unpack(">ii", packet[60:68]) == rate


def test_ifacialmocap_has_the_app_s_names(open_mouth: LiveFrame) -> None:
    (packet,) = TARGETS["ifacialmocap"].open_encoder().packets(open_mouth)
    curves, turns = packet.decode().split("|=")
    values = dict(part.rsplit("-", 1) for part in curves.split("|"))
    assert len(values) == 52 and {"eyeBlink_L", "mouthSmile_R", "jawLeft", "mouthRight"} <= set(
        values
    )
    assert int(values["jawOpen"]) == round(100 * open_mouth.arkit["jawOpen"])
    head, right, left, end = turns.split("|")
    assert head == "head#0.000,20.000,0.000,0,0,0" or head == "head#-0.000,20.000,0.000,0,0,0"
    assert (right, left, end) == ("rightEye#0,0,0", "leftEye#0,0,0", "")


def test_json_has_curves_and_turns(open_mouth: LiveFrame) -> None:
    (packet,) = TARGETS["json"].open_encoder().packets(open_mouth)
    record = json.loads(packet)
    assert record["version"] == 1 and record["head_deg"]["yaw"] == 20
    assert set(record["curves"]) <= set(ARKIT_NAMES)
    for name in COLUMNS:
        assert record["curves"].get(name, 0) == pytest.approx(open_mouth.arkit[name], abs=1e-4)


@pytest.mark.parametrize(
    ("wanted", "told"),
    [
        ("unreal", r"`to` unreal: unknown; allowed: livelink, vmc, .*json"),
        ("vmc=127.0.0.1:0", r"port '0'; allowed: 1 to 65535"),
        ("vmc=127.0.0.1:x", r"port 'x'"),
        ("vmc=127.0.0.1:395390", r"port '395390'"),
        ("json=192.0.2.1", r"target 192\.0\.2\.1: .*another machine.*allow_remote"),
        ("json=no such host", r"no address of 'no such host'"),
    ],
)
def test_a_target_that_cannot_be_is_refused(wanted: str, told: str) -> None:
    with pytest.raises(InputError, match=told):
        open_outputs([wanted])


def test_another_machine_may_be_allowed() -> None:
    (output,) = open_outputs(["json=192.0.2.1:9000"], Access(allow_remote=True))
    assert output.address == "192.0.2.1:9000"
    output.close()
