"""What the trainings on a corpus have in common: settings and clips that they refuse."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

pytest.importorskip("torch", reason="needs the extra `train`")

from elocute.corpus.corpus_store import Corpus
from elocute.encoders.registry import resolve_encoder
from elocute.errors import CorpusError, ModelError
from elocute.training.karras import training_data as karras
from elocute.training.karras.settings import KarrasTrainConfig
from elocute.training.settings import TrainingSettings
from elocute.training.voca import training_data as voca
from elocute.training.voca.settings import VocaTrainConfig


def prepare_voca(corpus: Corpus) -> Any:
    return voca.prepare(corpus, VocaTrainConfig(), resolve_encoder("fbank"))


def prepare_karras(corpus: Corpus) -> Any:
    return karras.prepare(corpus, KarrasTrainConfig())


@pytest.mark.parametrize(
    ("settings", "field"),
    [
        *[(VocaTrainConfig, name) for name in ("epochs", "batch_pairs", "learning_rate")],
        *[(KarrasTrainConfig, name) for name in ("epochs", "run_frames", "emotion_frames")],
        (KarrasTrainConfig, "learning_rate"),
    ],
)
def test_settings_out_of_range_are_refused(settings: type[TrainingSettings], field: str) -> None:
    with pytest.raises(ModelError, match=field):
        settings(**{field: -1})


@pytest.mark.parametrize("settings", [VocaTrainConfig, KarrasTrainConfig])
def test_a_preset_of_no_name_is_refused(settings: type[TrainingSettings]) -> None:
    with pytest.raises(ModelError, match="default, paper"):
        settings.preset("publication")


@pytest.mark.parametrize("prepare", [prepare_voca, prepare_karras])
def test_clips_with_nan_are_refused_before_the_first_epoch(
    prepare: Callable[[Corpus], Any], tmp_path: Path, make_corpus: Callable[..., Corpus]
) -> None:
    broken = make_corpus(tmp_path / "c")
    motion = np.load(broken.folder / "motion.npy", mmap_mode="r+")
    motion[broken.entry("plain.s1").start + 3] = np.nan
    motion.flush()
    with pytest.raises(CorpusError, match=r"plain\.s1.*NaN"):
        prepare(broken)
