"""From a trained network to one ONNX file that needs no torch and streams."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from elocute.audio.mel_with_deltas import BANDS, CONTEXT, MARGIN
from elocute.files.atomic import write_atomically
from elocute.motion.motion import Motion
from elocute.networks.crnn import HIDDEN, SharedCrnn
from elocute.training.crnn.fit import TrainedCrnn
from elocute.training.onnx_metadata import attach_constant, attach_record

OPSET = 17


class _Stream(nn.Module):
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
    """Write the network in its shared form, with state in and out, its basis and its settings.

    basis  a Motion on the head whose shapes the outputs weigh. Raises OutputError.
    """
    import onnx

    columns = torch.zeros(2 * (CONTEXT + MARGIN) + 1 + 20, BANDS)
    starts = torch.tensor([0, 3, 7])
    state = torch.zeros(1, 1, HIDDEN)
    with write_atomically(path) as draft:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            torch.onnx.export(
                _Stream(SharedCrnn(trained.network)).eval(),
                (columns, starts, state, state),
                str(draft),
                input_names=["columns", "starts", "hidden", "cell"],
                output_names=["weights", "hidden_after", "cell_after"],
                opset_version=OPSET,
                dynamo=False,
                dynamic_axes={
                    "columns": {0: "column"},
                    "starts": {0: "frame"},
                    "weights": {0: "frame"},
                },
            )
        model = onnx.load(draft)
        attach_constant(model, "basis", basis.head.expression_basis)
        attach_record(model, _record(trained, basis, note))
        onnx.save(model, draft)


def _record(trained: TrainedCrnn, basis: Motion, note: str) -> dict[str, Any]:
    return {
        "kind": "crnn",
        "version": 1,
        "fps": trained.config.fps,
        "outputs": len(basis.names),
        "topology": basis.head.name,
        "vertices": basis.head.vertex_count,
        "config": trained.config.record(),
        "note": note,
    }
