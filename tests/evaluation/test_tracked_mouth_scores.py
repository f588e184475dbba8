"""The real-talker measure on recordings whose answer is known."""

import json

import numpy as np
import pytest

from elocute.errors import InputError
from elocute.evaluation.tracked_mouth_scores import (
    evaluate_tracked_mouths,
    find_tracked_mouths,
    read_tracked_mouth,
)
from elocute.motion.curves import Curves

EYES_MM = 90.0
FPS = 25


def tracked(folder, name="clip", opening=None):
    """A recording whose lips close at 1.0 s (a b word) and are wide at 1.6 s (another)."""
    import soundfile

    times = np.arange(75) / FPS
    if opening is None:
        opening = 0.08 - 0.08 * np.exp(-(((times - 1.0) / 0.06) ** 2))
    words = [[0, 0.8, "sil"], [1.0, 1.5, "blue"], [1.6, 2.0, "at"], [2.0, 3.0, "sil"]]
    np.savez(
        folder / f"{name}.npz",
        t=times,
        inner_opening_mean=opening,
        lip_width=0.6 - opening,
        valid=np.ones(75),
        words=json.dumps(words),
    )
    soundfile.write(folder / f"{name}.ogg", np.zeros(16000 * 3), 16000, format="OGG")
    return opening


def answer(opening, lag_s=0.0, fps=50):
    """A predictor that knows the answer, late by lag_s."""
    times = np.arange(3 * fps) / fps
    mm = np.interp(times - lag_s, np.arange(len(opening)) / FPS, opening) * EYES_MM
    values = np.stack([mm, 0.6 * EYES_MM - mm], axis=1)
    return lambda sound: Curves(values, ("opening_mm", "width_mm"), fps)


def test_the_truth_scores_one(tmp_path):
    opening = tracked(tmp_path)
    summary, _ = evaluate_tracked_mouths(tmp_path, answer(opening), EYES_MM)
    assert summary.opening_r == pytest.approx(1, abs=1e-6)
    assert summary.width_r == pytest.approx(1, abs=1e-6)
    assert (summary.closure_recall, summary.false_closure) == (1, 0)
    assert (summary.real_closure_recall, summary.real_false_closure) == (1, 0)


def test_a_late_truth_is_found_at_its_lag(tmp_path):
    opening = tracked(tmp_path)
    summary, scores = evaluate_tracked_mouths(tmp_path, answer(opening, lag_s=0.08), EYES_MM)
    assert summary.opening_r < 0.9 < summary.opening_best_r
    assert scores[0].opening_lag_s == pytest.approx(0.08)


def test_a_mouth_that_never_moves_scores_nothing(tmp_path):
    tracked(tmp_path)
    summary, _ = evaluate_tracked_mouths(tmp_path, answer(np.full(75, 0.05)), EYES_MM)
    assert summary.opening_best_r == 0 and summary.closure_recall == 0


def test_a_mouth_that_stays_shut_closes_everywhere(tmp_path):
    tracked(tmp_path)
    summary, _ = evaluate_tracked_mouths(tmp_path, answer(np.zeros(75)), EYES_MM)
    assert (summary.closure_recall, summary.false_closure) == (1, 1)


def test_names_choose_takes_and_missing_ones_are_said(tmp_path):
    for name in ("a", "b", "c"):
        tracked(tmp_path, name)
    assert [p.stem for p in find_tracked_mouths(tmp_path, ["b"])] == ["b"]
    with pytest.raises(InputError, match=r"d\.npz is missing"):
        find_tracked_mouths(tmp_path, ["d"])


def test_bad_folders_and_files_are_refused(tmp_path):
    with pytest.raises(InputError, match=r"no \.npz"):
        find_tracked_mouths(tmp_path)
    with pytest.raises(InputError, match="no folder"):
        find_tracked_mouths(tmp_path / "none")
    tracked(tmp_path)
    (tmp_path / "clip.ogg").unlink()
    with pytest.raises(InputError, match="no sound"):
        read_tracked_mouth(tmp_path / "clip.npz")
    np.savez(tmp_path / "clip.npz", t=np.zeros(3))
    (tmp_path / "clip.ogg").write_bytes(b"x")
    with pytest.raises(InputError, match="no tracked mouth"):
        read_tracked_mouth(tmp_path / "clip.npz")


@pytest.mark.shared_data
def test_the_real_talker_closes_at_his_b_words(shared_data):
    folder = shared_data / "grid_s1"
    names = (folder / "dev.txt").read_text().split()[:20]

    def shut(sound):
        return Curves(np.zeros((75, 2), np.float32), ("opening_mm", "width_mm"), 25)

    summary, _ = evaluate_tracked_mouths(folder / "clips", shut, EYES_MM, names=names)
    assert summary.real_closure_recall > 0.9 > 0.6 > summary.real_false_closure
