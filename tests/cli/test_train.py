"""`elocute train voca` from a corpus folder to a model that animates."""

from __future__ import annotations

import json
import os
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from elocute.models.model_file import open_session, stored_record
from tests.support.commands import one_line, refused, run_apart, succeeds

pytest.importorskip("torch", reason="needs the extra `train`")


@pytest.mark.slow
def test_a_corpus_becomes_a_model_that_animates(
    tmp_path: Path, make_corpus: Callable[..., object], speech_wav: Path
) -> None:
    make_corpus(tmp_path / "corpus")
    train = "train", "voca", tmp_path / "corpus", "-o", tmp_path / "out"
    settings = "--epochs", 2, "--encoder", "fbank", "--device", "cpu", "--json"
    done = run_apart(*train, *settings)
    assert done.returncode == 0, done.stderr
    record = json.loads(done.stdout)
    assert record["epoch"] == 2
    for name in ("model.onnx", "checkpoint.safetensors", "log.csv", "sample.png"):
        assert (tmp_path / "out" / name).stat().st_size > 0
    model = "--model", tmp_path / "out" / "model.onnx"
    succeeds("animate", speech_wav, *model, "-o", tmp_path / "t.npz")
    refused(*train, says="--resume")


@pytest.mark.slow
def test_the_baseline_is_trained_and_used_as_every_other_model(
    tmp_path: Path, make_corpus: Callable[..., object], speech_wav: Path
) -> None:
    """Karras et al.: `train karras`, then everything that takes a model."""
    make_corpus(tmp_path / "corpus")
    small = "--epochs", 1, "--batch", 2, "--run-frames", 8, "--emotion-frames", 8
    out, model = tmp_path / "out", tmp_path / "out" / "model.onnx"
    done = succeeds("train", "karras", tmp_path / "corpus", "-o", out, *small, "--json")
    record = json.loads(done.stdout)
    assert record["styles"] == ["plain", "neutral"] and record["epoch"] == 1
    for name in ("model.onnx", "checkpoint.safetensors", "log.csv", "sample.png"):
        assert (out / name).stat().st_size > 0
    asked = "--model", model, "--json"
    succeeds("animate", speech_wav, "--model", model, "-o", tmp_path / "talk.npz")
    for name, given in {
        "corpus": (tmp_path / "corpus", *asked),
        "noise": (speech_wav, "--levels", "-12", *asked),
        "styles": (speech_wav, *asked),
        "identities": (speech_wav, "--count", 2, *asked),
    }.items():
        assert json.loads(succeeds("evaluate", name, *given).stdout)
    fitted = succeeds("style", "fit", tmp_path / "talk.npz", "--sound", speech_wav, *asked)
    assert set(json.loads(fitted.stdout)["mix"]) <= {"plain", "neutral"}
    refused("train", "karras", tmp_path / "corpus", "-o", out, says="--resume")
    refused("train", "karras", tmp_path / "corpus", "-o", out, "--run-frames", 1, says="run-frames")


@pytest.mark.parametrize(
    ("arguments", "told"),
    [
        (["nowhere"], "corpus.json"),
        (["{corpus}", "--epochs", "0"], "epochs"),
        (["{corpus}", "--device", "cuda:99"], "no such device here; allowed: auto, cpu"),
        (["{corpus}", "--device", "gpu"], "auto, cpu, cuda, cuda:N, mps"),
        (["{corpus}", "--encoder", "ears"], "phones"),
        (["{corpus}", "--split", "other"], "default"),
    ],
)
def test_what_cannot_be_trained_is_one_line(
    tmp_path: Path, make_corpus: Callable[..., object], arguments: list[str], told: str
) -> None:
    make_corpus(tmp_path / "corpus")
    given = [word.format(corpus=tmp_path / "corpus") for word in arguments]
    refused("train", "voca", *given, "-o", tmp_path / "out", says=told)
    assert not (tmp_path / "out" / "model.onnx").exists()


def test_what_fails_before_the_first_epoch_leaves_no_folder(
    tmp_path: Path, make_corpus: Callable[..., object], run: Callable[..., Any]
) -> None:
    make_corpus(tmp_path / "corpus")
    out = tmp_path / "out"
    for wrong in (("--split", "other"), ("--encoder", "ears")):
        one_line(run("train", "voca", tmp_path / "corpus", "-o", out, *wrong))
        assert not out.exists()
    if Path("/proc/self").exists():
        done = run("train", "voca", tmp_path / "corpus", "-o", "/proc/elocute")
        one_line(done, "/proc/elocute: cannot be ")


@pytest.mark.slow
@pytest.mark.skipif(sys.platform != "linux", reason="other systems refuse such a name")
def test_a_folder_whose_name_is_no_text_is_trained_in_and_gone_on_in(
    tmp_path: Path, make_corpus: Callable[..., object], run: Callable[..., Any], speech_wav: Path
) -> None:
    make_corpus(tmp_path / "corpus")
    out = tmp_path / os.fsdecode(b"\xff\xfe")
    given = ("train", "voca", tmp_path / "corpus", "-o", out, "--encoder", "fbank", "--json")
    for more in ((1,), (2, "--resume")):
        done = run(*given, "--device", "cpu", "--epochs", *more)
        assert done.returncode == 0, done.stderr
    assert json.loads(done.stdout)["epoch"] == 2
    model = ("--model", out / "model.onnx")
    done = run("animate", speech_wav, *model, "-o", tmp_path / "a.csv", "--fps", 5)
    assert done.returncode == 0, done.stderr


def test_a_training_goes_on_only_where_one_began(
    tmp_path: Path, make_corpus: Callable[..., object]
) -> None:
    make_corpus(tmp_path / "corpus")
    (tmp_path / "mine").mkdir()
    (tmp_path / "mine" / "log.csv").write_text("my notes")
    train = "train", "voca", tmp_path / "corpus", "-o", tmp_path / "mine", "--resume"
    refused(*train, says="no checkpoint.safetensors beside it")
    assert (tmp_path / "mine" / "log.csv").read_text() == "my notes"


def header(**tensors: object) -> bytes:
    text = json.dumps(tensors).encode()
    return len(text).to_bytes(8, "little") + text


def tensor(dtype: object = "F32", shape: object = (2,), at: object = (0, 8)) -> dict[str, object]:
    return {"dtype": dtype, "shape": shape, "data_offsets": at}


FORGED = {
    "nothing": b"",
    "a header of 16 exabytes": b"\xff" * 8 + b"{}",
    "a header that is cut": header(a=tensor())[:-3],
    "a list for a header": (2).to_bytes(8, "little") + b"[]",
    "deep JSON": (10**6).to_bytes(8, "little") + b"[" * 10**6,
    "places behind the end": header(a=tensor(at=(0, 10**12))) + bytes(8),
    "places below zero": header(a=tensor(at=(-8, 0))) + bytes(8),
    "places on top of each other": header(a=tensor(), b=tensor()) + bytes(8),
    "a gap": header(a=tensor(at=(8, 16))) + bytes(16),
    "a shape of terabytes": header(a=tensor(shape=(10**12,))) + bytes(8),
    "a shape that overflows": header(a=tensor(shape=(2**62, 4))) + bytes(8),
    "a shape below zero": header(a=tensor(shape=(-2,))) + bytes(8),
    "a million axes": header(a=tensor(shape=(1,) * 10**6, at=(0, 4))) + bytes(4),
    "a type that there is not": header(a=tensor("F99")) + bytes(8),
    "a type that is a list": header(a=tensor(["F32"])) + bytes(8),
    "a tensor that is text": header(a="F32") + bytes(8),
    "metadata that are numbers": header(__metadata__={"a": 1}, a=tensor()) + bytes(8),
    "one name twice": (lambda text: len(text).to_bytes(8, "little") + text + bytes(16))(
        b'{"a":{"dtype":"F32","shape":[2],"data_offsets":[0,8]},'
        b'"a":{"dtype":"F32","shape":[2],"data_offsets":[8,16]}}'
    ),
    "other tensors": header(a=tensor()) + bytes(8),
}


def test_forged_checkpoints_are_one_line(
    tmp_path: Path, make_corpus: Callable[..., object], run: Callable[..., Any]
) -> None:
    make_corpus(tmp_path / "corpus")
    (tmp_path / "out").mkdir()
    place = tmp_path / "out" / "checkpoint.safetensors"
    for name, data in FORGED.items():
        place.write_bytes(data)
        done = run("train", "voca", tmp_path / "corpus", "-o", place.parent, "--resume", "--json")
        lines = done.stderr.splitlines()
        assert done.returncode == 2 and len(lines) == 1, (name, done.stderr[-500:])
        assert str(place) in lines[0] and len(lines[0]) < 1000, (name, lines[0])
        assert place.read_bytes() == data


@pytest.mark.slow
def test_the_preset_of_the_paper_and_what_changes_it(
    tmp_path: Path, make_corpus: Callable[..., object], run: Callable[..., Any]
) -> None:
    make_corpus(tmp_path / "corpus", vertices=True)
    train = ("train", "voca", tmp_path / "corpus", "--encoder", "fbank", "--epochs", "1")
    settings = {}
    for name, more in (("all", ()), ("reduced", ("--reduced", "--batch", "32"))):
        done = run(*train, "-o", tmp_path / name, "--preset", "paper", *more)
        assert done.returncode == 0, done.stderr
        settings[name] = stored_record(open_session(tmp_path / name / "model.onnx"))["config"]
    assert settings["all"] | {"epochs": 50, "encoder": "deepspeech"} == {
        "epochs": 50,
        "batch_pairs": 64,
        "learning_rate": 1e-4,
        "position_weight": 1.0,
        "velocity_weight": 10.0,
        "components": 50,
        "seed": 0,
        "reduced": False,
        "initialisers": "released",
        "encoder": "deepspeech",
    }
    assert settings["reduced"] == settings["all"] | {"reduced": True, "batch_pairs": 32}
    done = run(*train, "-o", tmp_path / "none", "--preset", "publication")
    assert (done.returncode, done.stderr) == (
        2,
        "elocute: --preset: 'publication'; allowed: default, paper\n",
    )
