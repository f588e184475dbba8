"""From a trained network to one ONNX file that needs no torch."""

from __future__ import annotations

from dataclasses import asdict, replace
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from elocute.corpus.corpus_store import Corpus
from elocute.networks.voca import SharedVoca, Voca
from elocute.training.onnx_export import export_network
from elocute.training.target_space import MotionSpace
from elocute.training.voca.fit import TrainedVoca

MM = 1000.0


class _Embedding(nn.Module):
    """Features and a style to weights, the last of which is always one.

    A decoder is linear, so its columns are a basis and its bias a shape whose weight is one.
    """

    def __init__(self, voca: Voca) -> None:
        super().__init__()
        self.shared = SharedVoca(voca)

    def forward(self, features: Tensor, style: Tensor) -> Tensor:
        embedded = self.shared.embed(features, style)
        return torch.nn.functional.pad(embedded, (0, 1), value=1.0)


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
    components = corpus.components if basis is None else ()
    export_network(
        network,
        {
            "features": torch.zeros(40, trained.network.config.features),
            "style": torch.zeros(1, trained.network.config.styles),
        },
        ["weights"],
        {"features": {0: "frame"}, "weights": {0: "frame"}},
        path,
        record=_record(trained, corpus, components, note),
        constants={} if basis is None else {"basis": basis.numpy()},
    )


def _runnable(trained: TrainedVoca) -> tuple[nn.Module, Tensor | None]:
    """The network that gives weights, and its own basis (component, vertex, 3) m if it has one."""
    network, space = trained.network, trained.space
    if space is not None and space.to_weights is not None:
        return SharedVoca(_folded(network, torch.from_numpy(space.to_weights))), None
    return _Embedding(network), decoder_basis(network.decoder, space)


def decoder_basis(decoder: nn.Linear, space: MotionSpace | None) -> Tensor:
    """(component, vertex, 3) m: the columns of a decoder in mm, and its bias as the last."""
    shapes = torch.cat([decoder.weight.detach().T, decoder.bias.detach()[None]]) / MM
    if space is not None:
        shapes = shapes @ torch.from_numpy(space.basis)
    return shapes.reshape(len(shapes), -1, 3)


def decoder_to_weights(decoder: nn.Linear, to_weights: Tensor) -> dict[str, Tensor]:
    """Weight and bias of a decoder to coordinates, made one to weights of the corpus's shapes."""
    weight, bias = decoder.weight.detach(), decoder.bias.detach()
    return {"weight": to_weights.T @ weight, "bias": bias @ to_weights}


def _folded(network: Voca, to_weights: Tensor) -> Voca:
    """The same network decoding to weights of the corpus's components."""
    folded = Voca(replace(network.config, outputs=to_weights.shape[1]))
    decoder = decoder_to_weights(network.decoder, to_weights)
    changed = {f"decoder.{name}": value for name, value in decoder.items()}
    folded.load_state_dict({**network.state_dict(), **changed})
    return folded


def _record(
    trained: TrainedVoca, corpus: Corpus, components: tuple[str, ...], note: str
) -> dict[str, Any]:
    return {
        "kind": "voca",
        "version": 1,
        "encoder": trained.config.encoder,
        "fps": trained.fps,
        "styles": trained.styles,
        "features": trained.network.config.features,
        "components": components,
        "topology": corpus.topology,
        "vertices": corpus.vertex_count,
        "config": asdict(trained.config),
        "note": note,
    }
