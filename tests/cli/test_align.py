"""`elocute align` and `elocute evaluate alignment`, and what they refuse."""

from __future__ import annotations

import csv
import json
from collections.abc import Callable, Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import soundfile

pytest.importorskip("numba", reason="needs the extra `wild`")


def takes_of_a_word(folder: Path, speech: Path, edges: Sequence[float]) -> Path:
    """A folder of one word by three takes: real speech at three paces, cut in the same parts."""
    room = folder / "first"
    room.mkdir()
    samples, rate = soundfile.read(speech, dtype="float32")
    samples = samples[: int((edges[-1] + 0.1) * rate)]
    for name, pace in (("a", 1.0), ("b", 0.9), ("c", 1.1)):
        soundfile.write(room / f"{name}.wav", samples, round(rate * pace))
        times = (np.array(edges) / pace).tolist()
        parts = [[a, b, p] for a, b, p in zip(times, times[1:], "WXYZ", strict=False)]
        (room / f"{name}.json").write_text(json.dumps({"phones": parts}))
    return folder


@pytest.fixture(scope="module")
def words(tmp_path_factory: pytest.TempPathFactory, speech_wav: Path) -> Path:
    """One word of 1.6 s by three takes."""
    folder = tmp_path_factory.mktemp("words")
    return takes_of_a_word(folder, speech_wav, [0.1, 0.45, 0.8, 1.2, 1.5])


def test_two_recordings_are_aligned_and_drawn(
    words: Path, tmp_path: Path, cli: Callable[..., object]
) -> None:
    pair, plot = (words / "first" / "a.wav", words / "first" / "b.wav"), tmp_path / "plot.png"
    done = cli("align", *pair, "--method", "softdtw", "--plot", plot, "--json")
    record = json.loads(done.stdout)  # pyright: ignore[reportAttributeAccessIssue]
    path = np.array(record["path"])
    assert record["frames"] == (path[-1] + 1).tolist() and 0 < record["score"] <= 1
    assert np.abs(path[:, 0] / 0.9 - path[:, 1]).mean() < 1.5
    assert plot.read_bytes().startswith(b"\x89PNG") and plot.stat().st_size > 10_000
    plain = json.loads(cli("align", *pair, "--json").stdout)  # pyright: ignore
    assert plain == record  # soft-DTW is what is taken where nothing is said
    text = cli("align", *pair, "--method", "dtw").stdout  # pyright: ignore[reportAttributeAccessIssue]
    assert "score" in text and "shift" in text


def test_a_method_that_learns_says_how_far_it_is(words: Path) -> None:
    pytest.importorskip("torch", reason="needs the extra `train`")
    from elocute.alignment import speech_view
    from elocute.alignment.methods import align
    from elocute.alignment.settings import CcaSoftConfig, DcawConfig, DctwConfig
    from elocute.audio.read import read_audio

    views = [speech_view(read_audio(words / "first" / f"{name}.wav")) for name in "ab"]
    for method, config in (
        ("dcaw", DcawConfig(steps=3)),
        ("cca-soft", CcaSoftConfig(steps=3)),
        ("dctw", DctwConfig(steps=5, rounds=2)),
    ):
        told: list[float] = []
        align(views, method, config, done=told.append)
        assert told == [(step + 1) / config.steps for step in range(config.steps)]


@pytest.mark.slow
def test_attention_is_drawn_and_the_posterior_apart(
    words: Path, tmp_path: Path, cli: Callable[..., object]
) -> None:
    pytest.importorskip("torch", reason="needs the extra `train`")
    from PIL import Image

    pair, widths = (words / "first" / "a.wav", words / "first" / "b.wav"), {}
    for method in ("dcaw", "cca-soft"):
        plot = tmp_path / f"{method}.png"
        cli("align", *pair, "--method", method, "--plot", plot, "--json")
        with Image.open(plot) as drawn:
            widths[method] = drawn.width
    assert widths["cca-soft"] > 1.6 * widths["dcaw"]  # two matrices beside each other


def test_bad_input_of_align_is_one_line(
    words: Path, tmp_path: Path, refused: Callable[..., None]
) -> None:
    sound = words / "first" / "a.wav"
    silent, short = tmp_path / "silent.wav", tmp_path / "short.wav"
    soundfile.write(silent, np.zeros(16000, np.float32), 16000)
    soundfile.write(short, np.zeros(1, np.float32), 16000)
    refused("align", sound, tmp_path / "none.wav", says="no such file")
    refused("align", sound, silent, "--method", "dtw", says="nothing changes")
    refused("align", sound, short, "--method", "dtw", says="short.wav")
    refused("align", sound, sound, "--method", "magic", says="dtw, softdtw, ctw")
    refused("align", sound, sound, "--method", "dtw", "--band", "-3", says="band")
    refused("align", sound, sound, "--method", "dtw", "--band", "3", "--find", says="open ends")
    refused("align", sound, sound, "--encoder", "ears", says="phones")
    refused("align", sound, sound, "--plot", tmp_path / "plot.jpg", says=".png")
    refused("align", sound, sound, "--plot", tmp_path / "no" / "plot.png", says="mkdir")


def test_long_recordings_in_small_files_do_not_take_the_machine(
    tmp_path: Path, refused: Callable[..., None]
) -> None:
    for seconds in (95, 700):
        silence = np.zeros(seconds * 8000, np.int16)
        soundfile.write(tmp_path / f"s{seconds}.flac", silence, 8000)
    long, short = tmp_path / "s700.flac", tmp_path / "s95.flac"
    assert long.stat().st_size < 20_000
    refused("align", long, short, says="s700.flac: 700.0 s; allowed: up to 600 s")
    refused("align", short, short, says="allowed: up to 89 s each")


def test_methods_are_judged_by_known_times(
    words: Path, tmp_path: Path, cli: Callable[..., object], refused: Callable[..., None]
) -> None:
    arguments = ("evaluate", "alignment", words, "--methods", "diagonal,dtw,ctw", "--json")
    table = tmp_path / "table.csv"
    table.write_text("mine")
    refused(*arguments, "--table", table, says="--overwrite replaces it, --no-clobber keeps it")
    assert table.read_text() == "mine"
    given = (*arguments, "--per-word", "--table", table, "--overwrite")
    record = json.loads(cli(*given).stdout)  # pyright: ignore
    methods = record["methods"]
    with table.open(newline="", encoding="utf-8") as file:
        errors = {row["method"]: float(row["error frames"]) for row in csv.DictReader(file)}
    assert errors == {name: cells["error_frames"] for name, cells in methods.items()}
    assert list(methods) == ["diagonal", "dtw", "ctw"] and len(record["words"]) == 3
    # Takes differ in pace alone, so proportion is the truth but for the ends of the features.
    assert methods["diagonal"]["error_frames"] < 0.5 and methods["diagonal"]["overlap"] > 0.9
    assert methods["dtw"]["error_frames"] < 1.5 and methods["dtw"]["overlap"] > 0.75


@pytest.mark.slow
def test_learned_methods_are_judged_beside_them(words: Path, cli: Callable[..., object]) -> None:
    pytest.importorskip("torch", reason="needs the extra `train`")
    names = ["dtw", "dctw", "cca-soft", "dcaw", "dcaw/together", "dctw/expected", "dcaw/features"]
    done = cli("evaluate", "alignment", words, "--methods", ",".join(names), "--json")
    methods = json.loads(done.stdout)["methods"]  # pyright: ignore
    assert list(methods) == names
    # Three takes that differ in pace alone teach little, and should spoil as little.
    assert all(methods[name]["error_frames"] < 1.5 for name in names)
    assert methods["dctw/expected"]["error_frames"] != methods["dctw"]["error_frames"]


@pytest.mark.slow
def test_an_ablation_leaves_out_every_part(
    tmp_path: Path, speech_wav: Path, refused: Callable[..., None]
) -> None:
    pytest.importorskip("torch", reason="needs the extra `train`")
    from elocute.evaluation.alignment_scores import ablation_variants, compare_methods, score_folder

    words = takes_of_a_word(tmp_path, speech_wav, [0.1, 0.3, 0.5])
    brief = [
        replace(each, settings=tuple(({"steps": 2} | dict(each.settings)).items()))
        if each.method in ("dctw", "cca-soft", "dcaw")
        else each
        for each in ablation_variants(together=True)
    ]
    rows, broken = score_folder(words, brief)
    methods = compare_methods(rows, "dcaw/together")
    assert not broken and "against" in methods["dtw"] and "against" not in methods["dcaw/together"]
    for name in ("ctw/together/expected", "cca-soft: no guide", "cca-soft: no prior"):
        assert "against" in methods[name]
    parts = {name.removeprefix("dcaw: ") for name in methods if name.startswith("dcaw: ")}
    assert {"attention fixed", "attention uniform", "attention diagonal", "attention off"} <= parts
    assert methods["dcaw: attention off"] != methods["dcaw/together"]
    # The same list is what the command compares.
    refused(
        *("evaluate", "alignment", words, "--ablation", "--tested", "magic"),
        says="dcaw: attention off",
    )


def test_bad_input_of_the_judgement(
    words: Path, tmp_path: Path, refused: Callable[..., None]
) -> None:
    command = ("evaluate", "alignment")
    refused(*command, tmp_path / "none", says="not a folder")
    refused(*command, tmp_path, says="no folder of recordings")
    refused(*command, words, "--methods", "dtw,magic", says="magic")
    refused(*command, words, "--methods", ",", says="none")
    refused(*command, words, "--methods", "softdtw/expected", says="nothing after its name")
    refused(*command, words, "--methods", "dtw/loudly", says="expected, features, together")
    refused(*command, words, "--methods", "dtw,ctw", "--tested", "dcaw", says="dtw, ctw")
    refused(*command, words, "--noise-db", "90", says="60")
    (tmp_path / "word").mkdir()
    for name in ("a", "b"):
        soundfile.write(tmp_path / "word" / f"{name}.wav", np.ones(8000, np.float32) / 9, 16000)
        (tmp_path / "word" / f"{name}.json").write_text('{"phones": [[1, 0, "A"]]}')
    refused(*command, tmp_path, says="out of order")
