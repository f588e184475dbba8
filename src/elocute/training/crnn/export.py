"""From a trained network to one ONNX file that needs no torch and streams."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from elocute.audio.mel_with_deltas import BANDS, CONTEXT, MARGIN
from elocute.motion.motion import Motion
from elocute.networks.crnn import HIDDEN, SharedCrnn
from elocute.training.crnn.fit import TrainedCrnn
from elocute.training.onnx_export import export_network


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

    Parameters
    ----------
    trained
        What `fit` returned.
    basis
        A Motion on the head whose shapes the outputs weigh; the file carries its basis.
    path
        The file to write (.onnx).
    note
        What it was trained on, in words for people.

    Raises
    ------
    OutputError
        Where the file cannot be written.
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
