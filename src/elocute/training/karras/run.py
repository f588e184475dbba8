"""A whole training in one call: corpus folder in, model.onnx out."""

from __future__ import annotations

from pathlib import Path

from elocute.corpus.corpus_store import Corpus
from elocute.files.work_folder import MODEL
from elocute.training.epochs import open_folder
from elocute.training.karras.export import export_karras
from elocute.training.karras.fit import TrainedKarras, fit
from elocute.training.karras.settings import KarrasTrainConfig
from elocute.training.karras.training_data import prepare
from elocute.training.training_log import Report


def train_karras(
    corpus: Corpus,
    config: KarrasTrainConfig,
    folder: str | Path,
    split: str = "default",
    *,
    resume: bool = False,
    report: Report | None = None,
    note: str = "",
    device: str = "auto",
) -> TrainedKarras:
    """Train the network of Karras et al. 2017 on a corpus and export it.

    Parameters
    ----------
    corpus
        Clips with sound and motion.
    config
        Settings.
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
    TrainedKarras

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
    data = prepare(corpus, config, split, report)
    trained = fit(data, config, folder, resume=resume, report=report, device=device)
    export_karras(trained, corpus, folder / MODEL, note or corpus.note)
    return trained
