"""ARKit curves as Live Link Face writes them."""

import csv
from dataclasses import replace

import numpy as np
import pytest

from elocute.errors import MotionError
from elocute.export.arkit_csv import arkit_curves, timecode, write_csv
from elocute.export.curve_files import read_curves
from elocute.motion.curves import ARKIT_NAMES

RECORDED = (
    "EyeBlinkLeft,EyeLookDownLeft,EyeLookInLeft,EyeLookOutLeft,EyeLookUpLeft,EyeSquintLeft,"
    "EyeWideLeft,EyeBlinkRight,EyeLookDownRight,EyeLookInRight,EyeLookOutRight,EyeLookUpRight,"
    "EyeSquintRight,EyeWideRight,JawForward,JawRight,JawLeft,JawOpen,MouthClose,MouthFunnel,"
    "MouthPucker,MouthRight,MouthLeft,MouthSmileLeft,MouthSmileRight,MouthFrownLeft,"
    "MouthFrownRight,MouthDimpleLeft,MouthDimpleRight,MouthStretchLeft,MouthStretchRight,"
    "MouthRollLower,MouthRollUpper,MouthShrugLower,MouthShrugUpper,MouthPressLeft,"
    "MouthPressRight,MouthLowerDownLeft,MouthLowerDownRight,MouthUpperUpLeft,MouthUpperUpRight,"
    "BrowDownLeft,BrowDownRight,BrowInnerUp,BrowOuterUpLeft,BrowOuterUpRight,CheekPuff,"
    "CheekSquintLeft,CheekSquintRight,NoseSneerLeft,NoseSneerRight,TongueOut,HeadYaw,HeadPitch,"
    "HeadRoll,LeftEyeYaw,LeftEyePitch,LeftEyeRoll,RightEyeYaw,RightEyePitch,RightEyeRoll"
)
"""The columns of the app's recordings, in their order, as readers that go by place have them."""


def unreal_time_s(text: str) -> float:
    """When Unreal's importer places a row: it takes frames as sixtieths of a second."""
    hours, minutes, seconds, frames = text.split(":")
    return 3600 * int(hours) + 60 * int(minutes) + int(seconds) + float(frames) / 60


def test_the_layout_is_live_links(motion, tmp_path):
    write_csv(motion, tmp_path / "talk.csv")
    with (tmp_path / "talk.csv").open(newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0] == ["Timecode", "BlendShapeCount", *RECORDED.split(",")]
    assert {name[0].lower() + name[1:] for name in rows[0][2:54]} == set(ARKIT_NAMES)
    assert all(len(row) == 63 and row[1] == "61" for row in rows[1:])
    assert len(rows) == motion.frame_count + 1


def test_the_curves_come_back(motion, tmp_path):
    write_csv(motion, tmp_path / "talk.csv")
    back = read_curves(tmp_path / "talk.csv").curves
    assert back.fps == motion.fps
    assert np.allclose(back.values, arkit_curves(motion).values, atol=1e-6)
    assert back["jawOpen"].max() > 0.1


def test_speech_shapes_beyond_arkit_are_told_in_its_words(motion):
    curves = arkit_curves(motion)
    frame = int(motion.weights[:, motion.names.index("mouthLabiodental")].argmax())
    assert curves["mouthRollLower"][frame] > 0.3


def test_curves_stand_below_their_names(motion, tmp_path):
    weights = np.zeros_like(motion.weights[:1])
    for name, weight in (("jawLeft", 0.25), ("jawRight", 0.5), ("mouthLeft", 0.75)):
        weights[0, motion.names.index(name)] = weight
    write_csv(replace(motion, weights=weights), tmp_path / "talk.csv")
    with (tmp_path / "talk.csv").open(newline="") as file:
        (row,) = csv.DictReader(file)
    assert [float(row[name]) for name in ("JawLeft", "JawRight", "MouthLeft", "MouthRight")] == [
        0.25,
        0.5,
        0.75,
        0,
    ]


@pytest.mark.parametrize(
    ("frame", "fps", "text"),
    [
        (0, 30, "00:00:00:00.000"),
        (45, 30, "00:00:01:30.000"),
        (60 * 3661, 60, "01:01:01:00.000"),
        (119, 120, "00:00:00:59.500"),
        (24, 23.976, "00:00:01:00.060"),
    ],
)
def test_timecode(frame, fps, text):
    assert timecode(frame, fps) == text


@pytest.mark.parametrize("fps", [12.5, 23.976, 24.0, 25, 29.97, 30.0, 50, 59.94, 60.0, 100, 120])
def test_unreal_places_rows_where_they_belong(fps):
    """At whole seconds as well: never sixty sixtieths."""
    told = [timecode(frame, fps) for frame in range(5000)]
    assert told == sorted(told) and len(set(told)) == len(told)
    assert {len(text) for text in told} == {15}
    off = [unreal_time_s(text) - frame / fps for frame, text in enumerate(told)]
    assert np.abs(off).max() <= 0.5 / 60000 + 1e-9
    assert max(float(text[9:]) for text in told) < 60


def test_a_file_without_the_columns_is_refused(tmp_path):
    (tmp_path / "bad.csv").write_text("a,b\n1,2\n")
    with pytest.raises(MotionError, match="no column"):
        read_curves(tmp_path / "bad.csv")
