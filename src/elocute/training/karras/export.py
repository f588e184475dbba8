"""From a trained network to one ONNX file that needs no torch."""

from __future__ import annotations

from pathlib import Path

import torch
from torch import Tensor, nn
from torch.nn import functional

from elocute.audio.autocorrelation import COEFFICIENTS, ROW_RATE, WINDOW_ROWS
from elocute.corpus.corpus_store import Corpus
from elocute.networks.karras import SharedKarras
from elocute.training.decoder import Embedding, decoder_basis, decoder_to_weights
from elocute.training.karras.fit import TrainedKarras
from elocute.training.onnx_export import corpus_record, export_network

ROWS = 100  # of the example that is traced; any number runs


class _Weights(nn.Module):
    """Rows of sound and a style to weights of the corpus's shapes."""

    def __init__(self, shared: SharedKarras, decoder: dict[str, Tensor]) -> None:
        super().__init__()
        self.shared, self.weight, self.bias = shared, decoder["weight"], decoder["bias"]

    def forward(self, features: Tensor, style: Tensor) -> Tensor:
        return functional.linear(self.shared.embed(features, style), self.weight, self.bias)


def export_karras(trained: TrainedKarras, corpus: Corpus, path: str | Path, note: str = "") -> None:
    """Write a trained network as ONNX, its configuration in the metadata.

    A corpus with weights gives weights of the same components; one with vertices gives weights of
    the model's own basis, which the file carries.

    Parameters
    ----------
    trained
        What `fit` returned.
    corpus
        The corpus that it was trained on.
    path
        The file to write (.onnx).
    note
        What it was trained on, in words for people.

    Raises
    ------
    OutputError
        Where the file cannot be written.
    """
    shared = SharedKarras(trained.network, trained.emotions)
    space, decoder = trained.space, trained.network.decoder
    constants = {}
    if space is not None and space.to_weights is not None:
        network = _Weights(shared, decoder_to_weights(decoder, torch.from_numpy(space.to_weights)))
    else:
        network = Embedding(shared)
        constants = {"basis": decoder_basis(decoder, space).numpy()}
    export_network(
        network,
        {
            "features": torch.zeros(ROWS, COEFFICIENTS),
            "style": torch.full((1, len(trained.styles)), 1 / len(trained.styles)),
        },
        ["weights"],
        {"features": {0: "row"}, "weights": {0: "window"}},
        path,
        record={
            "kind": "karras",
            "version": 1,
            "encoder": "autocorrelation",
            "fps": ROW_RATE,
            "window": WINDOW_ROWS,
            **corpus_record(
                trained.config, trained.styles, COEFFICIENTS, corpus, "basis" in constants, note
            ),
        },
        constants=constants,
    )
