"""A small corpus with real speech in it: the example's words, cut and simulated."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import elocute
from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.corpus.clip import Clip
from elocute.corpus.split import Split
from elocute.corpus.store import Corpus, open_corpus
from elocute.corpus.writer import corpus_writer
from elocute.head.builtin import load_builtin_head

EXAMPLE = Path(elocute.__file__).parent / "assets" / "example.flac"
FPS = 60.0
SUBJECTS = ("plain", "broad", "tense")


def make_corpus(folder: Path, *, vertices: bool = False, fps: float = FPS) -> Corpus:
    """Three subjects say three stretches of the example; the last sentence of each is its own."""
    head = load_builtin_head()
    speech = read_audio(EXAMPLE).resample(16000)
    templates = {
        name: head.identity_template(np.full(3, 0.3 * i, np.float32)).astype(np.float32)
        for i, name in enumerate(SUBJECTS)
    }
    basis = None if vertices else head.expression_basis
    names = () if vertices else head.expression_names
    with corpus_writer(
        folder, templates, fps=fps, basis=basis, components=names, faces=head.quads,
        topology=head.name,
    ) as writer:  # fmt: skip
        for index, subject in enumerate(SUBJECTS):
            for part in range(3):
                piece = speech.samples[part * 16000 : part * 16000 + 24000]
                animation = elocute.animate(Waveform(piece, 16000), fps=fps, style=subject)
                weights = animation.motion.weights
                frames = weights
                if vertices:
                    moved = weights @ head.expression_basis.reshape(len(weights[0]), -1)
                    frames = templates[subject] + moved.reshape(len(weights), -1, 3)
                sentence = f"s{part}" if part < 2 else f"own{index}"
                writer.add(
                    Clip(subject, sentence, f"words {sentence}", Waveform(piece, 16000), frames)
                )
        writer.splits["default"] = Split(
            tuple(e.name for e in writer.entries if e.subject == "plain"), ("broad.own1",),
            ("tense.own2",),
        )  # fmt: skip
    return open_corpus(folder)


@pytest.fixture(scope="session")
def corpus(tmp_path_factory: pytest.TempPathFactory) -> Corpus:
    return make_corpus(tmp_path_factory.mktemp("corpus") / "weights")


@pytest.fixture(scope="session")
def vertex_corpus(tmp_path_factory: pytest.TempPathFactory) -> Corpus:
    return make_corpus(tmp_path_factory.mktemp("corpus") / "vertices", vertices=True, fps=30.0)
