"""ARKit curves as Live Link Face writes them."""

import csv

import numpy as np
import pytest

from elocute.errors import MotionError
from elocute.export.arkit_csv import arkit_curves, read_csv_curves, timecode, write_csv
from elocute.motion.curves import ARKIT_NAMES


def test_the_layout_is_live_links(motion, tmp_path):
    write_csv(motion, tmp_path / "talk.csv")
    with (tmp_path / "talk.csv").open(newline="") as file:
        rows = list(csv.reader(file))
    assert rows[0][:3] == ["Timecode", "BlendShapeCount", "EyeBlinkLeft"]
    assert rows[0][2:54] == [name[0].upper() + name[1:] for name in ARKIT_NAMES]
    assert len(rows[0]) == 63 and rows[1][1] == "61"
    assert len(rows) == motion.frame_count + 1


def test_the_curves_come_back(motion, tmp_path):
    write_csv(motion, tmp_path / "talk.csv")
    back = read_csv_curves(tmp_path / "talk.csv", motion.fps)
    assert np.allclose(back.values, arkit_curves(motion).values, atol=1e-6)
    assert back["jawOpen"].max() > 0.1


def test_speech_shapes_beyond_arkit_are_told_in_its_words(motion):
    curves = arkit_curves(motion)
    frame = int(motion.weights[:, motion.names.index("mouthLabiodental")].argmax())
    assert curves["mouthRollLower"][frame] > 0.3


@pytest.mark.parametrize(
    ("frame", "fps", "text"),
    [(0, 30, "00:00:00:00.000"), (45, 30, "00:00:01:15.000"), (60 * 3661, 60, "01:01:01:00.000")],
)
def test_timecode(frame, fps, text):
    assert timecode(frame, fps) == text


@pytest.mark.parametrize("fps", [23.976, 24.0, 29.97, 30.0, 59.94, 60.0])
def test_timecode_grows_and_never_counts_a_whole_second_of_frames(fps):
    told = [timecode(frame, fps) for frame in range(5000)]
    assert told == sorted(told) and len(set(told)) == len(told)
    assert max(float(text[9:]) for text in told) < round(fps)


def test_a_file_without_the_columns_is_refused(tmp_path):
    (tmp_path / "bad.csv").write_text("a,b\n1,2\n")
    with pytest.raises(MotionError, match="no column"):
        read_csv_curves(tmp_path / "bad.csv", 60)
