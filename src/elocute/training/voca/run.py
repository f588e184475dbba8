"""A whole training in one call: corpus folder in, model.onnx out."""

from __future__ import annotations

from pathlib import Path

from elocute.corpus.corpus_store import Corpus
from elocute.encoders.registry import resolve_encoder
from elocute.files.work_folder import MODEL
from elocute.training.device import by_first_process
from elocute.training.epochs import open_folder
from elocute.training.training_log import Report
from elocute.training.voca.export import export_voca
from elocute.training.voca.fit import TrainedVoca, fit
from elocute.training.voca.settings import VocaTrainConfig
from elocute.training.voca.style_errors import record_style_errors
from elocute.training.voca.training_data import prepare


def train_voca(
    corpus: Corpus,
    config: VocaTrainConfig,
    folder: str | Path,
    split: str = "default",
    *,
    resume: bool = False,
    report: Report | None = None,
    note: str = "",
    device: str = "auto",
) -> TrainedVoca:
    """Train VOCA on a corpus and export it.

    Parameters
    ----------
    corpus
        Clips with sound and motion.
    config
        Settings; the encoder is one of them.
    folder
        Where to leave model.onnx, checkpoint.safetensors, log.csv and TensorBoard's events.
    split
        Name of the corpus's split.
    resume
        Resume from the checkpoint in `folder`.
    report
        Called with progress.
    note
        What it was trained on, for the model file; the corpus's note by default.
    device
        As for `resolve_device`.

    Returns
    -------
    TrainedVoca

    Raises
    ------
    CorpusError
        For a corpus that it cannot be trained on.
    ModelError
        Where the checkpoint belongs to other settings, or the device is missing.
    OutputError
        Where a file cannot be written.
    """
    folder = open_folder(folder, device, resume=resume)
    data = prepare(corpus, config, resolve_encoder(config.encoder), split, report)
    trained = fit(data, config, folder, resume=resume, report=report, device=device)

    def export() -> None:
        export_voca(trained, corpus, folder / MODEL, note or corpus.note)
        record_style_errors(folder / MODEL, corpus, split)

    by_first_process(export)
    return trained
