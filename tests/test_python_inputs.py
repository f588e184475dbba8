"""What a careless program hands over: one of our errors, never one from inside."""

import io
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import elocute
from elocute.corpus.corpus_store import open_corpus
from elocute.corpus.shards import open_shards

SILENCE: Any = np.zeros(1600, np.float32)
TWO: Any = np.array([1, 2])
RAGGED: Any = [[1], [2, 3]]
ENDLESS: Any = np.broadcast_to(np.float32(0), (10**10,))
LONG = "x" * 300
GIVEN: dict[str, Callable[[], object]] = {
    "two rates": lambda: elocute.animate(SILENCE, rate=TWO),
    "two channels": lambda: elocute.animate(SILENCE, rate=16000, channel=TWO),
    "a style file that is none": lambda: elocute.animate(SILENCE, rate=16000, style=Path("a")),  # type: ignore[arg-type]
    "phones as text": lambda: elocute.animate(SILENCE, rate=16000, phones="60"),  # type: ignore[arg-type]
    "more samples than memory": lambda: elocute.animate(ENDLESS, rate=16000),
    "a file of text": lambda: elocute.animate(io.StringIO("la")),  # type: ignore[arg-type]
    "lists of unequal length": lambda: elocute.Waveform(RAGGED, 16000),
    "a block of such lists": lambda: list(elocute.stream(16000).push(RAGGED)),
    "a stream of two rates": lambda: elocute.stream(TWO),
    "curves of such lists": lambda: elocute.Curves(RAGGED, ("a",), 30),
    "curves of text": lambda: elocute.Curves("x", ("a",), 30),  # type: ignore[arg-type]
    "curves of a rate in words": lambda: elocute.Curves(SILENCE[:, None], ("a",), "30"),  # type: ignore[arg-type]
    "motion of text": lambda: elocute.Motion(elocute.load_builtin_head(), "x", 30),  # type: ignore[arg-type]
    "a corpus of a name too long": lambda: open_corpus(LONG),
    "shards of a name too long": lambda: open_shards(LONG, LONG),
}


@pytest.mark.parametrize("name", GIVEN)
def test_one_of_our_errors(name: str):
    with pytest.raises(elocute.InputError) as told:
        GIVEN[name]()
    assert "\n" not in str(told.value)


@pytest.mark.parametrize("outputs", [b"0", b"1", b"99"])
def test_a_model_that_says_less_or_more_of_itself(tmp_path: Path, outputs: bytes):
    from elocute.models import crnn_network

    said = re.compile(rb'"outputs": ?\d+')
    whole = crnn_network.SHIPPED_PATH.read_bytes()
    found = said.findall(whole)[0]
    forged = b'"outputs":' + outputs.rjust(len(found) - 10)
    (tmp_path / "forged.onnx").write_bytes(whole.replace(found, forged))
    with pytest.raises(elocute.InputError, match=r"forged\.onnx"):
        elocute.animate(SILENCE, rate=16000, model=tmp_path / "forged.onnx")
