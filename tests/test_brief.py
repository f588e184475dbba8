"""What Python shows of results is one line."""

from __future__ import annotations

import dataclasses
import importlib
import pkgutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

import elocute
from elocute.audio.features import Features
from elocute.corpus.split import Split
from elocute.one_line_repr import LONGEST, brief


def test_results_are_one_line(speech_wav: Path, make_corpus: Callable, tmp_path: Path) -> None:
    take = elocute.animate(speech_wav)
    corpus = make_corpus(tmp_path / "corpus")
    shown = (
        take,
        take.motion,
        take.curves,
        take.motion.head,
        elocute.read_audio(speech_wav),
        corpus,
        corpus.clip(corpus.entries[0].name),
        Features(np.zeros((900, 40), np.float32), 50.0, "phones"),
        Split(("a",) * 500, (), ("b",)),
    )
    for result in shown:
        assert "\n" not in repr(result) and len(repr(result)) < 200, repr(result)
    assert repr(take) == "Animation(640 frames at 60 fps, 10.67 s, sound 'example.flac')"
    assert repr(shown[7]) == "Features(values=float32(900, 40), rate=50.0, encoder='phones')"


def test_no_dataclass_spills_its_arrays() -> None:
    """Public ones: those with an array in them have a line of their own."""
    seen = 0
    for found in pkgutil.walk_packages(elocute.__path__, "elocute."):
        if found.name.startswith(("elocute.__main__", "elocute.jobs.ray_cluster")):
            continue
        try:
            module = importlib.import_module(found.name)
        except (ImportError, elocute.ElocuteError):
            continue  # an extra that is not installed
        for name, kind in vars(module).items():
            if not isinstance(kind, type) or kind.__module__ != found.name or name[0] == "_":
                continue
            if dataclasses.is_dataclass(kind):
                seen += 1
                texts = [str(field.type) for field in dataclasses.fields(kind) if field.repr]
                arrays = [text for text in texts if "Array" in text or "Indices" in text]
                line: Any = kind.__repr__
                assert not arrays or "__create_fn__" not in line.__qualname__, (found.name, name)
    assert seen > 100


def test_long_values_are_cut() -> None:
    assert brief("x" * 500).endswith("…") and len(brief("x" * 500)) < LONGEST
    assert brief(list(range(1000))) == "1000 × 0"
    assert brief(("a", 1)) == "('a', 1)"


def test_a_repr_that_fails_is_not_what_is_told() -> None:
    class Fails:
        def __repr__(self) -> str:
            raise RuntimeError

    assert brief(Fails()) == "<Fails object>"
    assert brief([Fails()]) == "(<Fails object>)"
