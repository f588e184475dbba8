"""`elocute style fit`: from somebody's motion to a style that `animate` takes."""

from __future__ import annotations

import importlib.util
import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile

import elocute

Cli = Callable[..., Any]


@pytest.fixture(scope="module")
def words(tmp_path_factory: pytest.TempPathFactory, speech_wav: Path) -> Path:
    """Three seconds of the example."""
    path = tmp_path_factory.mktemp("words") / "words.wav"
    samples, rate = soundfile.read(speech_wav, frames=3 * 32000)
    soundfile.write(path, samples, rate)
    return path


@pytest.fixture(scope="module")
def talk(words: Path, learned: Any) -> Path:
    """The model saying them as `tense` does, without what no style makes."""
    path = words.parent / "talk.npz"
    elocute.animate(words, model=learned.model, style="tense", life=0).write(path)
    return path


def test_a_style_goes_from_one_motion_to_another(
    cli: Cli, learned: Any, words: Path, talk: Path, tmp_path: Path
) -> None:
    mine = tmp_path / "mine.json"
    shown = cli("style", "fit", talk, "--sound", words, "--model", learned.model, "-o", mine).stdout
    best, *_, text = shown.splitlines()
    assert best.split()[0] == "tense" and text.startswith("tense:")
    stored = json.loads(mine.read_text())
    assert stored["best_style"] == next(iter(stored["mix"])) == "tense"
    assert (stored["model"], stored["seconds"]) == ("model.onnx", 3.0)
    again = tmp_path / "again.npz"
    cli("animate", words, "--life=0", "--model", learned.model, "--style", mine, "-o", again)
    weights = [elocute.load_motion(path).weights for path in (again, talk)]
    plain = elocute.animate(words, model=learned.model, style="plain", life=0).motion.weights
    assert np.abs(weights[0] - weights[1]).max() < 0.2 * np.abs(plain - weights[1]).max()


def test_clips_and_motions_are_one_speaker(cli: Cli, learned: Any, words: Path, talk: Path) -> None:
    clip = learned.corpus.folder / "tense.s0"
    options = "--model", learned.model, "--json"
    record = json.loads(cli("style", "fit", clip, *options).stdout)
    assert record["best_style"] == "tense" and record["seconds"] == 1.5
    assert set(record["styles_mm"]) == {"plain", "broad", "tense"}
    # What the fit counts is not millimetres alone (models/style_fit.py): they may rise a little.
    nearest, *others = sorted(record["styles_mm"].values())
    assert record["error_mm"] < 1.1 * nearest < others[0]
    assert next(iter(record["mix"])) == "tense"
    assert sum(record["mix"].values()) == pytest.approx(1, abs=1e-5)
    both = json.loads(cli("style", "fit", clip, talk, "--sound", words, *options).stdout)
    assert both["best_style"] == "tense" and both["seconds"] == 4.5


def test_what_cannot_be_fitted_is_one_line(
    refused: Cli, learned: Any, words: Path, talk: Path, tmp_path: Path
) -> None:
    model, corpus = ("--model", learned.model), learned.corpus.folder
    sound, output = ("--sound", words), ("-o", tmp_path / "mine.json")
    fit = "style", "fit"
    refused(*fit, talk, *model, *output, says="0 for 1 motions")
    refused(*fit, corpus / "plain.s0", *sound, *model, *output, says="1 for 0 motions")
    refused(*fit, corpus / "plain.none", *model, *output, says="plain.s0")
    refused(*fit, corpus, *model, *output, says="CORPUS/SUBJECT.SENTENCE")
    refused(*fit, tmp_path / "no.npz", *sound, *model, *output, says="no such file")
    refused(*fit, talk, "--sound", tmp_path / "no.wav", *model, *output, says="no.wav")
    unknown = "allowed: articulation, talkers, voca, crnn"
    refused(*fit, talk, *sound, "--model", words, *output, says=unknown)
    (words.parent / "words.onnx").write_bytes(words.read_bytes())
    broken = "--model", words.parent / "words.onnx"
    refused(*fit, talk, *sound, *broken, *output, says="no ONNX network")
    refused(*fit, talk, *sound, "--model", "crnn", *output, says="no styles")
    refused(*fit, talk, *sound, "--model", "no.onnx", *output, says="elocute train voca")
    refused(*fit, talk, *sound, *model, "-o", tmp_path / "mine.txt", says=".json")
    refused(*fit, talk, *sound, *model, "-o", tmp_path / "none" / "m.json", says="mkdir")
    assert list(tmp_path.iterdir()) == []


def test_a_new_style_is_stored_and_spoken(
    cli: Cli, learned: Any, words: Path, talk: Path, tmp_path: Path
) -> None:
    """Beyond the mix: at least as close, and what `--style` reads."""
    new, again = tmp_path / "new.json", tmp_path / "again.npz"
    options = "--sound", words, "--model", learned.model, "--new"
    shown = cli("style", "fit", talk, *options, "-o", new).stdout
    assert shown.splitlines()[-2].startswith("new style")
    stored = json.loads(new.read_text())
    assert set(stored["vector"]) == {"plain", "broad", "tense"}
    assert stored["vector_error_mm"] < min(stored["styles_mm"]["plain"], 0.3)
    cli("animate", words, "--life=0", "--model", learned.model, "--style", new, "-o", again)
    weights = [elocute.load_motion(path).weights for path in (again, talk)]
    plain = elocute.animate(words, model=learned.model, style="plain", life=0).motion.weights
    assert np.abs(weights[0] - weights[1]).mean() < 0.3 * np.abs(plain - weights[1]).mean()


def test_a_video_without_a_face_or_its_extra_is_one_line(
    refused: Cli, learned: Any, tmp_path: Path
) -> None:
    """The sound is read before minutes of tracking."""
    video, output = tmp_path / "me.mp4", tmp_path / "mine.json"
    model = "--model", learned.model, "-o", output
    refused("style", "fit", video, *model, says="me.mp4")
    video.write_bytes(b"no video")
    refused("style", "fit", video, *model, says="me.mp4")
    assert not output.exists()


@pytest.mark.shared_data
@pytest.mark.skipif(
    importlib.util.find_spec("mediapipe") is None, reason="needs the extra `video` (mediapipe)"
)
def test_a_video_is_captured_and_fitted(cli: Cli, shared_data: Path) -> None:
    """A talker whom `voca` learned from other clips of."""
    video = min((shared_data / "grid_s1" / "video").glob("*.mpg"))
    record = json.loads(cli("style", "fit", video, "--model", "voca", "--json").stdout)
    assert 2.5 < record["seconds"] <= 3.1 and sum(record["mix"].values()) == pytest.approx(1)
    assert record["error_mm"] <= min(record["styles_mm"].values()) + 0.05


def test_a_file_without_a_mix_moves_nobody(
    refused: Cli, learned: Any, words: Path, tmp_path: Path
) -> None:
    mine, output = tmp_path / "mine.json", tmp_path / "talk.npz"
    speak = "animate", words, "--model", learned.model, "--style", mine, "-o", output
    refused(*speak, says="no such file")
    mine.write_text('{"amplitude": 1.2}')
    refused(*speak, says="no mix of styles")
    mine.write_text('{"mix": {"nobody": 1}}')
    refused(*speak, says="plain, broad, tense")
    assert [path.name for path in tmp_path.iterdir()] == ["mine.json"]


def test_the_driver_s_own_styles_are_found_in_its_motion(
    cli: Cli, tmp_path: Path, speech_wav: Path
) -> None:
    """No model need be trained: the rules have styles too, and `animate` takes what was found."""
    take, mix = tmp_path / "take.npz", tmp_path / "mix.json"
    elocute.animate(speech_wav, style="mumble").write(take)
    shown = cli("style", "fit", take, "--sound", speech_wav, "-o", mix, "--json").stdout
    record = json.loads(shown)
    assert record["best_style"] == "mumble" and record["mix"]["mumble"] > 0.9
    again = elocute.animate(speech_wav, style=str(mix)).motion.weights
    broad = elocute.animate(speech_wav, style="broad").motion.weights
    mumbled = elocute.animate(speech_wav, style="mumble").motion.weights
    assert np.abs(again - mumbled).mean() < 0.2 * np.abs(broad - mumbled).mean()
