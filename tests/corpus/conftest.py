"""Corpora that several tests read."""

from __future__ import annotations

from collections.abc import Callable

import pytest

from elocute.corpus.corpus_store import Corpus


@pytest.fixture(scope="session")
def corpus(tmp_path_factory: pytest.TempPathFactory, make_corpus: Callable[..., Corpus]) -> Corpus:
    return make_corpus(tmp_path_factory.mktemp("corpus") / "weights")


@pytest.fixture(scope="session")
def vertex_corpus(
    tmp_path_factory: pytest.TempPathFactory, make_corpus: Callable[..., Corpus]
) -> Corpus:
    return make_corpus(tmp_path_factory.mktemp("corpus") / "vertices", vertices=True, fps=30.0)
