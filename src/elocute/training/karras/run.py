"""A whole training in one call: corpus folder in, one ONNX file out that needs no torch."""

from __future__ import annotations

from pathlib import Path

import torch
from torch import Tensor, nn
from torch.nn import functional

from elocute.audio.autocorrelation import COEFFICIENTS, ROW_RATE, WINDOW_ROWS
from elocute.corpus.corpus_store import Corpus
from elocute.files.work_folder import MODEL
from elocute.networks.karras import SharedKarras
from elocute.training.decoder import Embedding, decoder_basis, decoder_to_weights
from elocute.training.epochs import Report, open_folder
from elocute.training.karras.fit import TrainedKarras, fit
from elocute.training.karras.settings import KarrasTrainConfig
from elocute.training.karras.training_data import prepare
from elocute.training.onnx_export import corpus_record, export_network


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


ROWS = 100  # of the example that is traced; any number runs


class _Weights(nn.Module):
    """Rows of sound and a style to weights of the corpus's shapes."""

    def __init__(self, shared: SharedKarras, decoder: dict[str, Tensor]) -> None:
        super().__init__()
        self.shared, self.weight, self.bias = shared, decoder["weight"], decoder["bias"]

    def forward(self, features: Tensor, style: Tensor) -> Tensor:
        return functional.linear(self.shared.embed(features, style), self.weight, self.bias)


def export_karras(trained: TrainedKarras, corpus: Corpus, path: str | Path, note: str = "") -> None:
    """Write a trained network as ONNX, its configuration in the metadata, as `export_voca` does."""
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
