"""From a trained network to one ONNX file that needs no torch."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

import torch
from torch import Tensor, nn

from elocute.corpus.corpus_store import Corpus
from elocute.networks.voca import SharedVoca, Voca
from elocute.training.decoder import Embedding, decoder_basis, decoder_to_weights
from elocute.training.onnx_export import corpus_record, export_network
from elocute.training.voca.fit import TrainedVoca


def export_voca(trained: TrainedVoca, corpus: Corpus, path: str | Path, note: str = "") -> None:
    """Write a trained VOCA as ONNX, its configuration in the metadata; running it needs no torch.

    A corpus with weights gives weights of the same components; one with vertices gives weights
    of the model's own basis, which the file carries.

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
    network, basis = _runnable(trained)
    shape = trained.network.config
    features = shape.heard or shape.features
    export_network(
        network,
        {
            "features": torch.zeros(40, features),
            "style": torch.zeros(1, shape.styles),
        },
        ["weights"],
        {"features": {0: "frame"}, "weights": {0: "frame"}},
        path,
        record={
            "kind": "voca",
            "version": 1,
            "encoder": trained.config.encoder,
            "fps": trained.fps,
            **corpus_record(
                trained.config, trained.styles, features, corpus, basis is not None, note
            ),
        },
        constants={} if basis is None else {"basis": basis.numpy()},
    )


def _runnable(trained: TrainedVoca) -> tuple[nn.Module, Tensor | None]:
    """The network that gives weights, and its own basis (component, vertex, 3) m if it has one."""
    network, space = trained.network, trained.space
    if space is not None and space.to_weights is not None:
        return SharedVoca(_folded(network, torch.from_numpy(space.to_weights))), None
    return Embedding(SharedVoca(network)), decoder_basis(network.decoder, space)


def _folded(network: Voca, to_weights: Tensor) -> Voca:
    """The same network decoding to weights of the corpus's components."""
    folded = Voca(replace(network.config, outputs=to_weights.shape[1]))
    decoder = decoder_to_weights(network.decoder, to_weights)
    changed = {f"decoder.{name}": value for name, value in decoder.items()}
    folded.load_state_dict({**network.state_dict(), **changed})
    return folded
