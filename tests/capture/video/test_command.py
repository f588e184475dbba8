"""`elocute capture video` as a person meets it."""

from __future__ import annotations

import importlib.util
import json
from dataclasses import replace

import numpy as np
import pytest

from elocute.audio.read import read_audio
from elocute.capture.video.face_mesh_points import builtin_face_points
from elocute.capture.video_to_corpus import write_video_corpus
from elocute.corpus.corpus_store import open_corpus
from elocute.errors import CaptureError
from elocute.head.mediapipe_face_mesh import LIDS
from elocute.motion.mouth_measures import measure_mouth
from elocute.motion.store import load_motion
from tests.support.commands import one_line, run_apart

HAS_MEDIAPIPE = importlib.util.find_spec("mediapipe") is not None
needs_mediapipe = pytest.mark.skipif(
    not HAS_MEDIAPIPE, reason="needs the extra `video` (mediapipe==0.10.21)"
)


def run(*arguments):
    return run_apart("capture", "video", *arguments)


def lid_gaps_mm(motion):
    """(frame,) between the middles of the lids of the left eye."""
    points = builtin_face_points().on(motion.vertices())
    upper, lower = (list(LIDS[f"{lid}_left"][3:6]) for lid in ("upper", "lower"))
    return 1000 * (points[:, upper, 1] - points[:, lower, 1]).mean(axis=1)


@pytest.fixture(scope="module")
def talking(filmed, speech_wav, tmp_path_factory):
    """The filmed head drawn as video, with its speech: what a camera would give."""
    from elocute.audio.waveform import Waveform
    from elocute.export.options import PictureOptions
    from elocute.export.video import write_video

    path = tmp_path_factory.mktemp("video") / "talk.mp4"
    speech = read_audio(speech_wav).resample(16000)
    sound = Waveform(speech.samples[:64000], 16000)
    write_video(filmed.motion, path, sound=sound, options=PictureOptions(size=(360, 360)))
    return path


def test_bad_files_and_outputs_are_told_before_anything(tmp_path):
    (tmp_path / "bad.mp4").write_bytes(b"no video" * 50)
    one_line(run(tmp_path / "bad.mp4", "-o", tmp_path / "o.xyz"), "suffix '.xyz'")
    one_line(run(tmp_path / "bad.mp4", "-o", tmp_path / "gone" / "o.npz"), "does not exist")
    one_line(
        run(tmp_path / "bad.mp4", tmp_path / "b.mp4", "-o", tmp_path / "o.npz"), "for 2 videos"
    )
    one_line(run(tmp_path / "bad.mp4", "-o", tmp_path / "bad.mp4"), "an input of this run")
    (tmp_path / "there").mkdir()
    one_line(run(tmp_path / "bad.mp4", "-o", tmp_path / "there"), "exists already")
    (tmp_path / "there").rmdir()
    assert sorted(p.name for p in tmp_path.iterdir()) == ["bad.mp4"]


@pytest.mark.skipif(HAS_MEDIAPIPE, reason="the extra `video` is here")
def test_without_the_extra_it_says_what_to_install(talking, tmp_path):
    result = run(talking, "-o", tmp_path / "o.npz")
    assert result.returncode != 0
    assert "pip install 'elocute[video]'" in result.stderr
    assert len(result.stderr.strip().splitlines()) == 1
    assert not list(tmp_path.iterdir())


@needs_mediapipe
def test_a_drawn_head_comes_back_from_its_video(talking, filmed, tmp_path):
    result = run(talking, "-o", tmp_path / "o.npz", "-o", tmp_path / "o.glb", "--json")
    assert result.returncode == 0, result.stderr
    record = json.loads(result.stdout)
    assert record["frames"] == filmed.motion.frame_count
    assert record["lip_miss"] < 0.02
    motion = load_motion(tmp_path / "o.npz")
    true, found = (measure_mouth(m)["opening_mm"] for m in (filmed.motion, motion))
    assert np.corrcoef(true, found)[0, 1] > 0.9
    assert (found[true < 0.01] < 0.5).mean() > 0.8
    lids = lid_gaps_mm(motion)
    assert lids[39:42].max() < 0.3, "the blink shuts the eyes"
    assert lids[:38].min() > 0.8 * np.median(lids)
    blink = motion.weights[:, motion.names.index("eyeBlinkLeft")]
    assert blink[38:43].max() > 0.7
    assert blink[:38].max() < 0.2
    assert (tmp_path / "o.glb").stat().st_size > 100_000


@needs_mediapipe
def test_bad_videos_are_one_line(make_video, tmp_path):
    blank = make_video(tmp_path / "blank.mp4", [f / 25 for f in range(10)])
    one_line(run(blank, "-o", tmp_path / "o.npz"), "no face in 10 pictures")
    (tmp_path / "bad.mp4").write_bytes(b"no video" * 50)
    one_line(run(tmp_path / "bad.mp4", "-o", tmp_path / "o.npz"), "no video that can be read")
    assert not (tmp_path / "o.npz").exists()


@needs_mediapipe
@pytest.mark.shared_data
def test_a_real_talker_becomes_a_corpus(shared_data, tmp_path):
    videos = sorted((shared_data / "grid_s1/video").glob("*.mpg"))[:1]
    result = run(*videos, "-o", tmp_path / "corpus", "--subject", "ann", "--text", "bin blue")
    assert result.returncode == 0, result.stderr
    corpus = open_corpus(tmp_path / "corpus")
    entry = corpus.entries[0]
    assert (entry.name, entry.text, corpus.fps) == (f"ann.{videos[0].stem}", "bin blue", 60)
    tracked = np.load(shared_data / f"grid_s1/clips/{videos[0].stem}.npz")
    gap = np.interp(np.arange(entry.frames) / 60, tracked["t"], tracked["inner_opening_mean"])
    from elocute.evaluation.lip_closures import lip_opening
    from elocute.evaluation.model_predictions import recorded_motion

    assert np.corrcoef(gap, lip_opening(recorded_motion(corpus, entry.name)))[0, 1] > 0.95


def test_points_become_a_clip_with_the_sound_of_their_video(captured, talking, tmp_path):
    notes = write_video_corpus(tmp_path / "corpus", [(talking, captured)], subject="me")
    corpus = open_corpus(tmp_path / "corpus")
    assert [entry.name for entry in corpus.entries] == ["me.talk"]
    assert corpus.entries[0].frames == 240
    assert corpus.sound("me.talk").duration_s == pytest.approx(4.0, abs=0.05)
    assert notes


def test_a_silent_video_makes_no_clip(captured, talking, tmp_path):
    silent = replace(captured, track=replace(captured.track, has_sound=False))
    with pytest.raises(CaptureError, match="no sound"):
        write_video_corpus(tmp_path / "corpus", [(talking, silent)], subject="me")
    assert not (tmp_path / "corpus").exists()
