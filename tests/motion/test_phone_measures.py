"""Measures of each phone, and curves as tables."""

from __future__ import annotations

import csv

import numpy as np
import pytest

from elocute.animation import animate
from elocute.errors import MachineError, MotionError
from elocute.motion.curves import Curves
from elocute.motion.mouth_measures import measure_mouth, measure_phones
from tests.support.commands import refused, succeeds

RISING = np.arange(11, dtype=np.float32)
RAMP = Curves(np.stack([RISING, 100 - RISING], axis=1), ("a_mm", "b_mm"), 10)


def test_a_phone_has_the_mean_of_its_frames_and_its_middle():
    table = measure_phones(RAMP, [(0.2, 0.5, "AA"), (0.51, 0.57, "T"), (1.0, 1.1, "M")])
    assert table.columns[3:] == ("a_mm_mean", "a_mm_middle", "b_mm_mean", "b_mm_middle")
    # Frames 2, 3 and 4; no frame, so its middle at 0.54 s; the last frame.
    assert table.mean[:, 0] == pytest.approx([3, 5.4, 10])
    assert table.middle[:, 0] == pytest.approx([3.5, 5.4, 10])
    assert table.mean[:, 1] == pytest.approx(100 - table.mean[:, 0])
    phone, *numbers = table.rows()[0]
    assert phone == "AA" and numbers == pytest.approx([0.2, 0.5, 3, 3.5, 97, 96.5])
    assert measure_phones(RAMP, []).rows() == []


@pytest.mark.parametrize("phone", [(2.0, 2.1, "M"), (0.5, 0.4, "M"), (-1.0, 0.4, "M")])
def test_a_phone_of_another_take_is_refused(phone):
    with pytest.raises(MotionError, match=r"phone 'M': .*allowed: a stretch of these 1\.10 s"):
        measure_phones(RAMP, [phone])


def test_tables_of_pandas(monkeypatch):
    pytest.importorskip("pandas")
    frame = RAMP.to_pandas()
    assert list(frame.columns) == ["a_mm", "b_mm"] and frame.index.name == "time_s"
    assert frame.index.tolist() == pytest.approx(RAMP.times_s.tolist())
    assert frame["b_mm"].tolist() == RAMP["b_mm"].tolist()
    table = measure_phones(RAMP, [(0.2, 0.5, "AA")]).to_pandas()
    assert table.loc[0, "phone"] == "AA" and table.loc[0, "a_mm_middle"] == pytest.approx(3.5)
    monkeypatch.setitem(__import__("sys").modules, "pandas", None)
    with pytest.raises(MachineError, match="pip install pandas"):
        RAMP.to_pandas()


def test_the_command_writes_a_row_for_each_phone(speech_wav, tmp_path):
    take, times, out = (tmp_path / name for name in ("talk.npz", "talk.TextGrid", "phones.csv"))
    motion = animate(speech_wav, fps=30, look="none").motion
    from elocute.motion.store import save_motion

    save_motion(motion, take)
    succeeds("phones", speech_wav, "-o", times)
    succeeds("measure", take, "--phones", times, "-o", out)
    with out.open(newline="", encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert {"opening_mm_mean", "jaw_mm_middle"} <= set(rows[0])
    opening = measure_mouth(motion)
    first = next(row for row in rows if row["phone"] in ("M", "B", "P"))
    middle = (float(first["start_s"]) + float(first["end_s"])) / 2
    wanted = np.interp(middle, opening.times_s, opening["opening_mm"])
    assert float(first["opening_mm_middle"]) == pytest.approx(wanted, abs=2e-3)
    # Lips meet in the middle of what is bilabial, and part for vowels.
    vowels = [row for row in rows if row["phone"] in ("AA", "AE", "AY", "OW")]
    assert wanted < 0.5 < np.mean([float(row["opening_mm_mean"]) for row in vowels])
    words = tmp_path / "words.csv"
    words.write_text("start_s,end_s,word\n0.1,0.4,hello\n", encoding="utf-8")
    refused("measure", take, "--phones", words, "-o", tmp_path / "b.csv", says="words alone")
