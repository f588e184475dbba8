"""LRW's folders and plain ones; speakers on both sides of a split."""

from __future__ import annotations

from pathlib import Path

import av
import numpy as np
import pytest

from elocute.audio.read import read_audio
from elocute.errors import CorpusError
from elocute.propagation.word_recordings import find_recordings, word_span


def write_mp4(path: Path, seconds: float) -> None:
    """A clip as LRW's: AAC in mp4, some of which the coder adds, and 29 frames of picture."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with av.open(str(path), "w") as file:
        picture = file.add_stream("mpeg4", rate=25)
        picture.width = picture.height = 16
        stream = file.add_stream("aac", rate=16000, layout="mono")
        for _ in range(29):
            shown = av.VideoFrame.from_ndarray(np.zeros((16, 16, 3), np.uint8), "rgb24")
            file.mux(picture.encode(shown))
        file.mux(picture.encode(None))
        samples = np.random.default_rng(0).normal(0, 0.1, (1, round(seconds * 16000)))
        for start in range(0, samples.shape[1] - 1023, 1024):
            block = np.ascontiguousarray(samples[:, start : start + 1024], np.float32)
            frame = av.AudioFrame.from_ndarray(block, "fltp", "mono")
            frame.sample_rate = 16000
            file.mux(stream.encode(frame))
        file.mux(stream.encode(None))


def test_lrw(tmp_path: Path):
    for part in ("train", "val", "test"):
        clip = tmp_path / "lipread_mp4" / "ABOUT" / part / "ABOUT_00001.mp4"
        if part != "train":
            clip = clip.with_stem(f"ABOUT_0000{2 + (part == 'test')}")
        write_mp4(clip, 1.216)
        text = "Disk reference: 12345\nChannel: ANY\nDuration: 0.40 seconds\n"
        clip.with_suffix(".txt").write_text(text)
    found = find_recordings(tmp_path)
    assert list(found.words) == ["about"]
    clips, skipped = found.of("about")
    assert not skipped and [(c.clip, c.split) for c in clips] == [
        ("about.ABOUT_00003", "test"),
        ("about.ABOUT_00001", "train"),
        ("about.ABOUT_00002", "validation"),
    ]
    assert len({c.speaker for c in clips}) == 3
    duration = read_audio(tmp_path / clips[0].audio).duration_s
    assert duration > 1.2  # and the word is in the middle of the picture, of 1.16 s
    assert word_span(tmp_path, clips[0], duration) == pytest.approx((0.38, 0.78))


@pytest.mark.parametrize(("name", "span"), [("ABOUT_00001", (0.38, 0.78)), ("own__1", (0.4, 0.8))])
def test_sound_taken_out_of_lrw(tmp_path: Path, name: str, span: tuple[float, float]):
    """It was longer than its picture; other sounds have the word in their own middle."""
    wav = tmp_path / "about" / f"{name}.wav"
    wav.parent.mkdir()
    wav.touch()
    wav.with_suffix(".txt").write_text("Duration: 0.40 seconds\n")
    recording = find_recordings(tmp_path).of("about")[0][0]
    assert word_span(tmp_path, recording, 1.2) == pytest.approx(span)


def test_a_recording_is_another_one_once_its_sound_or_times_change(tmp_path: Path):
    """So that a run that is resumed makes its word again."""
    wav = tmp_path / "about" / "own__1.wav"
    wav.parent.mkdir()
    wav.write_bytes(b"RIFF")
    found = find_recordings(tmp_path)
    before = found.of("about")[0]
    assert found.of("about")[0] == before
    wav.with_suffix(".txt").write_text("Duration: 0.40 seconds\n")
    timed = found.of("about")[0]
    wav.with_suffix(".txt").write_text("Duration: 0.42 seconds\n")
    longer = found.of("about")[0]
    wav.write_bytes(b"RIFF...")
    assert before != timed != longer != found.of("about")[0]


@pytest.mark.parametrize("text", ["", "Duration: none", "Duration: 0 seconds", "Duration: 9 s"])
def test_a_txt_that_says_no_duration(tmp_path: Path, text: str):
    wav = tmp_path / "one" / "a__1.wav"
    wav.parent.mkdir()
    wav.touch()
    wav.with_suffix(".txt").write_text(text)
    recording = find_recordings(tmp_path).of("one")[0][0]
    with pytest.raises(CorpusError, match=r"a__1\.txt"):
        word_span(tmp_path, recording, 1.0)


def touched(folder: Path, *names: str) -> Path:
    for name in names:
        path = folder / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()
    return folder


def test_plain_folders_are_split_by_speaker(tmp_path: Path):
    names = [
        f"{word}/{speaker:03}__{take}.wav"
        for word in ("one", "Two")
        for speaker in range(40)
        for take in range(2)
    ]
    found = find_recordings(touched(tmp_path, *names))
    clips = [clip for word in found.words for clip in found.of(word)[0]]
    assert len(clips) == 160 and list(found.words) == ["two", "one"]
    parts: dict[str, set[str]] = {}
    for clip in clips:
        parts.setdefault(clip.speaker, set()).add(clip.split)
    assert all(len(part) == 1 for part in parts.values())
    assert {p for part in parts.values() for p in part} == {"train", "validation", "test"}


def test_a_speaker_on_both_sides_is_refused(tmp_path: Path):
    touched(tmp_path, "one/train/ann__1.wav", "two/test/ann__2.wav")
    with pytest.raises(CorpusError, match=r"speaker ann in train and in test"):
        find_recordings(tmp_path)


def test_a_recording_in_two_splits_is_refused(tmp_path: Path):
    touched(tmp_path, "ONE/train/ONE_00001.mp4", "ONE/val/ONE_00001.mp4")
    with pytest.raises(CorpusError, match=r"one\.ONE_00001 in two splits"):
        find_recordings(tmp_path)


def test_folders_that_hold_no_words(tmp_path: Path):
    with pytest.raises(CorpusError, match="no recordings of words"):
        find_recordings(tmp_path)
    with pytest.raises(CorpusError, match="no folder"):
        find_recordings(tmp_path / "none")


def test_names_that_cannot_be(tmp_path: Path):
    touched(tmp_path, "one/a b.wav", "one/ann.wav", "one/ann.flac", "one/.hidden.wav")
    clips, skipped = find_recordings(tmp_path).of("one")
    assert [c.audio for c in clips] == ["one/ann.flac"]
    assert [name for name, _ in skipped] == ["one/a b.wav", "one/ann.wav"]
