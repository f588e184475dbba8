"""A whole training in one call: shards in, model.onnx out."""

from __future__ import annotations

from pathlib import Path

from elocute.corpus.shards import Shards
from elocute.files.work_folder import MODEL
from elocute.training.crnn.export import export_crnn
from elocute.training.crnn.feature_cache import cache_features
from elocute.training.crnn.fit import TrainedCrnn, fit
from elocute.training.crnn.settings import CrnnTrainConfig
from elocute.training.crnn.training_data import select_training_data, training_clips
from elocute.training.epochs import open_folder
from elocute.training.training_log import Report


def train_crnn(
    shards: Shards,
    config: CrnnTrainConfig,
    folder: str | Path,
    *,
    resume: bool = False,
    report: Report | None = None,
    note: str = "",
    device: str = "auto",
) -> tuple[TrainedCrnn, tuple[tuple[str, str], ...]]:
    """Train the recurrent model on shards and export it.

    Parameters
    ----------
    shards
        Clips with sounds and parameters.
    config
        Settings.
    folder
        Where to leave model.onnx, checkpoint.safetensors, log.csv, TensorBoard's events and the
        features of all clips.
    resume
        Resume from the checkpoint in `folder`.
    report
        Called with progress.
    note
        What it was trained on, for the model file; the shards' note by default.
    device
        As for `resolve_device`.

    Returns
    -------
    trained : TrainedCrnn
    missing
        (clip, reason) of the clips that were left out.

    Raises
    ------
    CorpusError
        For shards that it cannot be trained on.
    ModelError
        Where the checkpoint belongs to other settings, or the device is missing.
    OutputError
        Where a file cannot be written.
    """
    folder = open_folder(folder, device, resume=resume)

    def encoding(share: float) -> None:
        if report:
            report(0.0, f"encoding the shards: {share:.0%}")

    basis = shards.basis
    cache = cache_features(shards, folder, config.fps, encoding, config.encoder)
    data = select_training_data(
        cache,
        basis.head.expression_basis,
        training_clips(cache, config),
        cache.select("validation"),
    )
    trained = fit(data, config, folder, resume=resume, report=report, device=device)
    export_crnn(trained, basis, folder / MODEL, note or shards.note)
    return trained, cache.missing
