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

import elocute
from elocute.articulation.style import STYLES
from elocute.corpus.corpus_store import Corpus
from elocute.evaluation.mouth_studies import sample_mixes
from elocute.models.registry import open_model
from elocute.motion.mouth_measures import measure_mouth

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
    (study,) = record["studies"]
    low, high = study["levels"]
    assert (record["clips"], low["level"], high["level"]) == (1, "-60 dB", "-6 dB")
    assert low["correlation"] > 0.95 > high["correlation"]
    with Image.open(tmp_path / "n.png") as picture:
        assert picture.size == (1400, 560)
    shown = cli("evaluate", "noise", words, "--levels", "-20,-20", "--noise", "gain").stdout
    assert len(shown.splitlines()) == 2 and "-20 dB" in shown


def test_models_and_kinds_of_noise_share_one_table_and_one_figure(
    cli: Cli, words: Path, tmp_path: Path
) -> None:
    plot, table = tmp_path / "n.png", tmp_path / "n.csv"
    models = "--model", "articulation", "--model", "voca", "--contacts", "both"
    kinds = "--noise", "street", "--noise", "telephone", "--levels", "-36,-12"
    out = cli("evaluate", "noise", words, *models, *kinds, "--plot", plot, "--table", table).stdout
    rows = [row.split(",") for row in table.read_text(encoding="utf-8").splitlines()]
    assert [row[:4] for row in rows[1:4]] == [
        ["articulation", "off", "street", "-36 dB"],
        ["articulation", "off", "street", "-12 dB"],
        ["articulation", "off", "telephone", "band"],
    ]
    assert len(rows) == 1 + 2 * 2 * 3
    with Image.open(plot) as picture:
        assert picture.size == (1400, 2 * 2 * 2 * 560)
    assert "simulated traffic" in out and "--noise FILE takes yours" in out


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
    assert record["studies"][0]["noise"] == words.name
    assert 0 < record["studies"][0]["levels"][0]["amplitude_share"] < 2


@pytest.mark.slow
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


@pytest.mark.slow
@pytest.mark.parametrize("mix", ["output", "input"])
def test_the_shaded_region_is_what_mixes_reach(cli: Cli, words: Path, mix: str) -> None:
    """Between the styles for mixes of outputs; mixes at the input leave it, and are measured."""
    styles = open_model("voca").styles
    chosen: dict[str, Any] = {"model": "voca", "contacts": "off", "mix": mix}

    def opening(style: str) -> np.ndarray:
        return measure_mouth(elocute.animate(words, style=style, life=0, **chosen).motion)[
            "opening_mm"
        ]

    alone = np.stack([opening(style) for style in styles])
    mixed = np.stack([opening(text) for text in sample_mixes(styles, 24)])
    out = max((alone.min(0) - mixed).max(), (mixed - alone.max(0)).max())
    assert out < 0.02 if mix == "output" else out > 0.02
    measure = "evaluate", "styles", words, "--model", "voca", "--contacts", "off", "--mix", mix
    record = json.loads(cli(*measure, "--json").stdout)
    every = np.concatenate([alone, mixed])
    assert record["reach_mm"] == pytest.approx(np.ptp(every if mix == "input" else alone, 0).mean())


def test_identities_are_told_by_their_spread(cli: Cli, words: Path) -> None:
    faces = "evaluate", "identities", words, "--count", 2, "--seed", 3
    record = json.loads(cli(*faces, "--json").stdout)
    (take,) = record["takes"]
    row = take["spread"]["width_range_mm"]
    assert 1 < row["least"] <= row["mean"] <= row["greatest"]
    assert take["spread"]["sealed"]["least"] == take["spread"]["closures"]["least"] > 0
    assert "2 faces, " in cli(*faces).stdout


def test_bare_networks_leave_lips_open_that_contacts_close(cli: Cli, speech_wav: Path) -> None:
    way = "--model", "crnn", "--contacts", "both"
    faces = "evaluate", "identities", speech_wav, "--count", 1, *way
    bare, finished = json.loads(cli(*faces, "--json").stdout)["takes"]
    assert bare["take"] == "crnn, contacts off" and finished["take"] == "crnn, contacts auto"
    assert bare["spread"]["widest_gap_mm"]["mean"] > 0.5
    assert finished["spread"]["widest_gap_mm"]["mean"] < 0.1


def test_a_stored_motion_on_faces_that_are_named(cli: Cli, words: Path, tmp_path: Path) -> None:
    """A face far outside the usual is found, written, and is the same when it is read again."""
    motion, wild, worst = (tmp_path / name for name in ("m.npz", "wild.json", "worst.json"))
    cli("animate", words, "-o", motion, "--fps", 30)
    coefficients = np.random.default_rng(6).choice([-5.0, 5.0], 50).tolist()
    wild.write_text(json.dumps({"identity": coefficients}), encoding="utf-8")
    named = "--identity", "mean", "--identity", wild
    run = "evaluate", "identities", motion, *named, "-o", worst
    (take,) = json.loads(cli(*run, "--json").stdout)["takes"]
    assert take["take"] == "m.npz" and list(take["faulty"]) == [str(wild)]
    assert json.loads(worst.read_text(encoding="utf-8"))["identity"] == coefficients + 27 * [0.0]
    shown = cli("evaluate", "identities", motion, "--identity", worst).stdout
    assert "1 faces, 1 with a fault" in shown and f"face {worst}: " in shown


@pytest.mark.parametrize(
    ("command", "options", "told"),
    [
        ("noise", ["--levels", "loud"], "dB from -120 to 60"),
        ("noise", ["--levels", "nan"], "dB from -120 to 60"),
        ("noise", ["--levels", "-12,"], "dB from -120 to 60"),
        ("noise", ["--noise", "pink"], "street, white, babble, telephone, gain or a sound file"),
        ("noise", ["--contacts", "some"], "auto, off, both"),
        ("noise", ["--table", "{}/n.txt"], ".csv or .tex"),
        ("identities", ["-o", "{}/n.txt"], ".json"),
        ("identities", ["--identity", "nobody"], "unknown"),
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
    refused("evaluate", "noise", tmp_path / "silence.wav", "--noise", "babble", says="silence")
    refused("evaluate", "noise", tmp_path, says="corpus.json")
    refused("evaluate", "styles", tmp_path / "none.wav", says="none.wav")
