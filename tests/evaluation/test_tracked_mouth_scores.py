"""The real-talker measure on recordings whose answer is known."""

import json

import numpy as np
import pytest

from elocute.errors import InputError
from elocute.evaluation.tracked_mouth_scores import evaluate_tracked_mouths
from elocute.evaluation.tracked_mouths import find_tracked_mouths, read_tracked_mouth
from elocute.motion.curves import Curves

EYES_MM = 90.0
FPS = 25


SPEECH = np.arange(150) < 100  # rows at 50 Hz: two seconds of speech, and a pause of one


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
        protrusion=0.1 + opening / 2,
        valid=np.ones(75),
        words=json.dumps(words),
    )
    soundfile.write(folder / f"{name}.ogg", np.zeros(16000 * 3), 16000, format="OGG")
    return opening


def answer(opening, lag_s=0.0, fps=50):
    """A predictor that knows the answer, late by lag_s."""
    times = np.arange(3 * fps) / fps
    mm = np.interp(times - lag_s, np.arange(len(opening)) / FPS, opening) * EYES_MM
    values = np.stack([mm, 0.6 * EYES_MM - mm, mm / 2], axis=1)
    return lambda sound: Curves(values, ("opening_mm", "width_mm", "protrusion_mm"), fps)


def evaluated(folder, predict, **options):
    """The report, with speech where the recordings have it."""
    return evaluate_tracked_mouths(folder, predict, EYES_MM, speech=lambda _: SPEECH, **options)


def talkers(folder, **clips):
    """A folder of many talkers: each clip with its talker, language and offset."""
    (folder / "clips").mkdir()
    records = []
    for name, (talker, language, offset_s) in clips.items():
        tracked(folder / "clips", name)
        record = {"id": name, "speaker": talker, "language": language, "offset_s": offset_s}
        records.append(record)
    records.append({"id": "rig", "speaker": "x", "kind": "curves"})
    (folder / "manifest.json").write_text(json.dumps({"clips": records}))


def test_the_truth_scores_one(tmp_path):
    opening = tracked(tmp_path)
    summary = evaluated(tmp_path, answer(opening)).summary
    assert summary.opening_r == pytest.approx(1, abs=1e-6)
    assert summary.width_r == pytest.approx(1, abs=1e-6)
    assert summary.protrusion_r == pytest.approx(1, abs=1e-6)
    assert (summary.closure_recall, summary.false_closure) == (1, 0)
    assert (summary.real_closure_recall, summary.real_false_closure) == (1, 0)


def test_a_late_truth_is_found_at_its_lag(tmp_path):
    opening = tracked(tmp_path)
    report = evaluated(tmp_path, answer(opening, lag_s=0.08))
    summary, scores = report.summary, report.clips
    assert summary.opening_r < 0.9 < summary.opening_best_r
    assert scores[0].opening_lag_s == pytest.approx(0.08)


def test_a_mouth_that_never_moves_scores_nothing(tmp_path):
    tracked(tmp_path)
    summary = evaluated(tmp_path, answer(np.full(75, 0.05))).summary
    assert summary.opening_best_r == 0 and summary.closure_recall == 0


def test_a_mouth_that_stays_shut_closes_everywhere(tmp_path):
    tracked(tmp_path)
    summary = evaluated(tmp_path, answer(np.zeros(75))).summary
    assert (summary.closure_recall, summary.false_closure) == (1, 1)


def test_names_choose_takes_and_missing_ones_are_said(tmp_path):
    for name in ("a", "b", "c"):
        tracked(tmp_path, name)
    assert [clip.path.stem for clip in find_tracked_mouths(tmp_path, ["b"])] == ["b"]
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


def test_an_offset_of_the_recording_is_taken_out(tmp_path):
    talkers(tmp_path, a=("ann", "en", -0.08))
    opening = tracked(tmp_path)
    score = evaluated(tmp_path, answer(opening, lag_s=0.08)).clips[0]
    assert score.opening_r < 0.9 < score.opening_synced_r
    assert score.opening_lag_s == pytest.approx(0)


def test_talkers_and_languages_have_rows_of_their_own(tmp_path):
    talkers(tmp_path, a=("ann", "en", None), b=("bob", "en", 0.0), c=("cem", "tr", 0.0))
    report = evaluated(tmp_path, answer(tracked(tmp_path)))
    groups = {group.group: group.takes for group in report.groups}
    assert groups == {
        "all": 3, "language en": 2, "language tr": 1, "talker ann": 1, "talker bob": 1,
        "talker cem": 1,
    }  # fmt: skip
    assert [(clip.talker, clip.language) for clip in report.clips][2] == ("cem", "tr")


def test_one_lag_for_all_clips_of_a_talker(tmp_path):
    """Each of two clips fits at a lag of its own; no lag fits both."""
    talkers(tmp_path, a=("ann", "en", 0.08), b=("ann", "en", -0.08))
    summary = evaluated(tmp_path, answer(tracked(tmp_path))).summary
    assert summary.opening_best_r > 0.99 > 0.9 > summary.opening_common_r


def test_half_the_movement_is_half_the_amplitude(tmp_path):
    opening = tracked(tmp_path)
    score = evaluated(tmp_path, answer((opening - 0.01) / 2)).summary
    assert score.amplitude_p50 == pytest.approx(0.5, abs=0.01)
    assert score.amplitude_p99 == pytest.approx(0.5, abs=0.01)
    assert score.jerk_p99 == pytest.approx(score.real_jerk_p99 / 2, rel=0.1)
    assert evaluated(tmp_path, answer(opening + 0.01)).summary.zero == 0


def test_a_box_is_told_by_its_jerk_and_its_zeros(tmp_path):
    opening = tracked(tmp_path)
    box = np.where(opening > 0.04, 0.08, 0.0)
    score = evaluated(tmp_path, answer(box)).summary
    assert score.jerk_p99 > 2 * score.real_jerk_p99
    assert score.zero > 0.02 and score.shut > 0.02


def test_pauses_are_told_apart_from_speech(tmp_path):
    opening = np.where(np.arange(75) < 50, 0.08, 0.0) + 0.01 * np.sin(np.arange(75))
    tracked(tmp_path, opening=np.abs(opening))
    score = evaluated(tmp_path, answer(np.full(75, 0.05))).summary
    assert score.pause_opening_mm == pytest.approx(4.5) and score.pause_shut == 0
    assert score.real_pause_opening_mm < 0.5 and score.real_pause_shut == 1
    assert score.real_shut == 0


def test_seals_are_counted_where_phones_are_known(tmp_path):
    opening = tracked(tmp_path)  # lips touch at 1.0 s
    assert evaluated(tmp_path, answer(opening)).summary.seals_right is None
    intervals = [(0.0, 0.96, "AA"), (0.96, 1.04, "B"), (1.04, 1.6, "AA"), (1.6, 1.7, "P")]
    lines = ['File type = "ooTextFile"', 'Object class = "TextGrid"', "", "0", "3", "<exists>", "1"]
    lines += ['"IntervalTier"', '"phones"', "0", "3", str(len(intervals) + 1)]
    for start, end, phone in [*intervals, (1.7, 3.0, "")]:
        lines += [str(start), str(end), f'"{phone}"']
    (tmp_path / "clip.TextGrid").write_text("\n".join(lines))
    score = evaluated(tmp_path, answer(opening)).summary
    assert (score.seals_right, score.seals_false, score.seals_missed) == (1, 0, 1)


@pytest.mark.parametrize(
    ("clip", "told"),
    [
        ({"id": "../a", "speaker": "ann"}, "plain id"),
        ({"id": "a", "speaker": 3}, "plain id"),
        ({"id": "a", "speaker": "ann", "offset_s": 30}, "offset"),
    ],
)
def test_bad_manifests_are_refused(tmp_path, clip, told):
    (tmp_path / "manifest.json").write_text(json.dumps({"clips": [clip]}))
    with pytest.raises(InputError, match=told):
        find_tracked_mouths(tmp_path)


@pytest.mark.shared_data
def test_the_real_talker_closes_at_his_b_words(shared_data):
    folder = shared_data / "grid_s1"
    names = (folder / "dev.txt").read_text().split()[:20]

    def shut(sound):
        return Curves(np.zeros((75, 2), np.float32), ("opening_mm", "width_mm"), 25)

    report = evaluate_tracked_mouths(folder / "clips", shut, EYES_MM, names=names)
    summary = report.summary
    assert summary.shut == 1 > summary.real_shut > 0
    assert summary.real_closure_recall > 0.9 > 0.6 > summary.real_false_closure
