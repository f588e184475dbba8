"""A whole training in one call: corpus folder in, model.onnx out."""

from __future__ import annotations

from pathlib import Path

from elocute.corpus.corpus_store import Corpus
from elocute.encoders.registry import resolve_encoder
from elocute.training.device import resolve_device
from elocute.training.voca.config import TrainConfig
from elocute.training.voca.export import export_onnx
from elocute.training.voca.fit import Report, Trained, fit, prepare

MODEL = "model.onnx"


def train_voca(
    corpus: Corpus,
    config: TrainConfig,
    folder: Path,
    split: str = "default",
    *,
    resume: bool = False,
    report: Report | None = None,
    note: str = "",
    device: str = "auto",
) -> Trained:
    """Hear the corpus, train, and leave model.onnx, checkpoint, log and events in `folder`.

    Raises CorpusError for a corpus that cannot be learned from, ModelError for settings that do
    not fit a checkpoint that is there, or a device that is not (see `resolve_device`).
    """
    resolve_device(device)  # before the corpus is heard
    material = prepare(corpus, config, resolve_encoder(config.encoder), split, report)
    trained = fit(material, config, folder, resume=resume, report=report, device=device)
    export_onnx(trained, corpus, folder / MODEL, note or corpus.note)
    return trained
