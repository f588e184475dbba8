"""`elocute evaluate noise`, `styles` and `identities` on two seconds of speech."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import soundfile
from PIL import Image

from elocute.articulation.style import STYLES
from elocute.corpus.corpus_store import Corpus

Cli = Callable[..., Any]


@pytest.fixture(scope="module")
def words(tmp_path_factory: pytest.TempPathFactory, speech_wav: Path) -> Path:
    path = tmp_path_factory.mktemp("words") / "words.wav"
    samples, rate = soundfile.read(speech_wav, start=32000, frames=2 * 32000)
    soundfile.write(path, samples, rate)
    return path


def test_noise_is_measured_level_by_level(cli: Cli, words: Path, tmp_path: Path) -> None:
    levels = "--levels", "-60,-6", "--noise", "white"
    record = json.loads(
        cli("evaluate", "noise", words, *levels, "--plot", tmp_path / "n.png", "--json").stdout
    )
    low, high = record["levels"]
    assert (record["clips"], low["level_db"], high["level_db"]) == (1, -60, -6)
    assert low["correlation"] > 0.95 > high["correlation"]
    with Image.open(tmp_path / "n.png") as picture:
        assert picture.size == (1400, 560)
    shown = cli("evaluate", "noise", words, "--levels", "-20,-20", "--noise", "gain").stdout
    assert len(shown.splitlines()) == 2 and "-20 dB" in shown


def test_noise_under_a_corpus_and_from_a_file(
    cli: Cli, words: Path, tmp_path: Path, make_corpus: Callable[..., Corpus]
) -> None:
    corpus = make_corpus(tmp_path / "corpus")
    record = json.loads(
        cli(
            "evaluate", "noise", corpus.folder, "--levels", "-30", "--noise", words, "--json"
        ).stdout
    )
    assert record["clips"] == len(corpus.split().test) == 1
    assert 0 < record["levels"][0]["amplitude_share"] < 2


def test_styles_of_the_driver_and_of_a_trained_model(
    cli: Cli, learned: Any, words: Path, tmp_path: Path
) -> None:
    record = json.loads(cli("evaluate", "styles", words, "--json").stdout)
    assert list(record["styles"]) == list(STYLES)
    assert record["styles"]["mumble"]["mean_mm"] < record["styles"]["broad"]["mean_mm"]
    assert record["reach_mm"] > 1
    plot = tmp_path / "styles.png"
    shown = cli("evaluate", "styles", words, "--model", learned.model, "--plot", plot).stdout
    names = [line.split()[0] for line in shown.splitlines()]
    assert names == ["plain", "broad", "tense", "range"] and plot.stat().st_size > 1000


def test_identities_are_told_by_their_spread(cli: Cli, words: Path) -> None:
    faces = "evaluate", "identities", words, "--count", 2, "--seed", 3
    record = json.loads(cli(*faces, "--json").stdout)
    row = record["spread"]["width_range_mm"]
    assert 1 < row["least"] <= row["mean"] <= row["greatest"]
    assert "2 faces" in cli(*faces).stdout


@pytest.mark.parametrize(
    ("command", "options", "told"),
    [
        ("noise", ["--levels", "loud"], "dB from -120 to 60"),
        ("noise", ["--levels", "nan"], "dB from -120 to 60"),
        ("noise", ["--levels", "-12,"], "dB from -120 to 60"),
        ("noise", ["--noise", "pink"], "white, babble, gain or a sound file"),
        ("noise", ["--noise", "gain", "--levels", "60"], "±100"),
        ("noise", ["--seed", "-1"], "--seed"),
        ("noise", ["--plot", "{}/n.txt"], ".png"),
        ("noise", ["--plot", "{}/none/n.png"], "mkdir"),
        ("noise", ["--style", "nobody"], "drawl"),
        ("styles", ["--model", "{}/none.onnx"], "elocute train voca"),
        ("styles", ["--plot", "{}"], ".png"),
        ("identities", ["--count", "0"], "count"),
        ("identities", ["--seed", "-1"], "seed"),
    ],
)
def test_what_cannot_be_measured_is_one_line(
    refused: Cli, words: Path, tmp_path: Path, command: str, options: list[str], told: str
) -> None:
    given = [option.format(tmp_path) for option in options]
    refused("evaluate", command, words, *given, says=told)
    assert list(tmp_path.iterdir()) == []


def test_silence_is_no_babble_and_a_folder_no_sound(refused: Cli, tmp_path: Path) -> None:
    soundfile.write(tmp_path / "silence.wav", np.zeros(16000), 16000)
    refused("evaluate", "noise", tmp_path / "silence.wav", says="noise: silence")
    refused("evaluate", "noise", tmp_path, says="corpus.json")
    refused("evaluate", "styles", tmp_path / "none.wav", says="none.wav")
