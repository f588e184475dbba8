"""A whole training in one call: shards in, one ONNX file out that needs no torch and streams."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from elocute.audio.mel_with_deltas import BANDS, CONTEXT, MARGIN
from elocute.corpus.shards import Shards
from elocute.files.work_folder import MODEL
from elocute.motion.motion import Motion
from elocute.networks.crnn import HIDDEN, SharedCrnn
from elocute.training.crnn.feature_cache import cache_features
from elocute.training.crnn.fit import TrainedCrnn, fit
from elocute.training.crnn.settings import CrnnTrainConfig
from elocute.training.crnn.training_data import select_training_data, training_clips
from elocute.training.epochs import Report, open_folder
from elocute.training.onnx_export import export_network


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


class StreamingCrnn(nn.Module):
    """(column, 128), (frame,) and the LSTM's (1, 1, 128) state to (frame, output) and state."""

    def __init__(self, shared: SharedCrnn) -> None:
        super().__init__()
        self.shared = shared

    def forward(
        self, columns: Tensor, starts: Tensor, hidden: Tensor, cell: Tensor
    ) -> tuple[Tensor, Tensor, Tensor]:
        out, (hidden, cell) = self.shared(columns[None], starts[None], (hidden, cell))
        return out[0], hidden, cell


def export_crnn(trained: TrainedCrnn, basis: Motion, path: str | Path, note: str = "") -> None:
    """Write a trained recurrent model as ONNX, its state an input and an output, so it streams.

    basis: a Motion on the head whose shapes the outputs weigh; the file carries its basis. note:
    what it was trained on, in words for people. Raises OutputError.
    """
    state = torch.zeros(1, 1, HIDDEN)
    features = trained.network.config.features or BANDS
    export_network(
        StreamingCrnn(SharedCrnn(trained.network)),
        {
            "columns": torch.zeros(2 * (CONTEXT + MARGIN) + 1 + 20, features),
            "starts": torch.tensor([0, 3, 7]),
            "hidden": state,
            "cell": state,
        },
        ["weights", "hidden_after", "cell_after"],
        {"columns": {0: "column"}, "starts": {0: "frame"}, "weights": {0: "frame"}},
        path,
        record=_record(trained, basis, note),
        constants={"basis": basis.head.expression_basis},
    )


def _record(trained: TrainedCrnn, basis: Motion, note: str) -> dict[str, Any]:
    return {
        "kind": "crnn",
        "version": 1,
        "encoder": trained.config.encoder,
        "fps": trained.config.fps,
        "outputs": len(basis.names),
        "topology": basis.head.name,
        "vertices": basis.head.vertex_count,
        "config": asdict(trained.config),
        "note": note,
    }
