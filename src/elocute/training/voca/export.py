"""From a trained network to one ONNX file that needs no torch."""

from __future__ import annotations

import warnings
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from elocute.corpus.corpus_store import Corpus
from elocute.files.atomic import write_atomically
from elocute.networks.voca import SharedVoca, Voca
from elocute.training.onnx_metadata import attach_constant, attach_record
from elocute.training.voca.fit import Trained

OPSET = 17
MM = 1000.0


class _Embedding(nn.Module):
    """Features and a style to weights, the last of them one.

    A decoder is linear, so its columns are a basis and its bias a shape whose weight is one.
    """

    def __init__(self, voca: Voca) -> None:
        super().__init__()
        self.shared = SharedVoca(voca)

    def forward(self, features: Tensor, style: Tensor) -> Tensor:
        embedded = self.shared.embed(features, style)
        return torch.nn.functional.pad(embedded, (0, 1), value=1.0)


def export_onnx(trained: Trained, corpus: Corpus, path: str | Path, note: str = "") -> None:
    """Write the network in its shared-window form, its configuration in the metadata.

    A corpus with weights gives weights of the same components; one with vertices gives weights
    of the model's own basis, which the file carries. Raises OutputError.
    """
    import onnx

    module, basis = _runnable(trained)
    components = corpus.components if basis is None else ()
    features = torch.zeros(40, trained.network.config.features)
    style = torch.zeros(1, trained.network.config.styles)
    with write_atomically(path) as draft:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            torch.onnx.export(
                module.eval(),
                (features, style),
                str(draft),
                input_names=["features", "style"],
                output_names=["weights"],
                opset_version=OPSET,
                dynamo=False,
                dynamic_axes={"features": {0: "frame"}, "weights": {0: "frame"}},
            )
        model = onnx.load(draft)
        if basis is not None:
            attach_constant(model, "basis", basis.numpy())
        attach_record(model, _record(trained, corpus, components, note))
        onnx.save(model, draft)


def _runnable(trained: Trained) -> tuple[nn.Module, Tensor | None]:
    """What gives weights, and the basis (component, vertex, 3) m where it is its own."""
    network, space = trained.network, trained.space
    if space is not None and space.to_weights is not None:
        return SharedVoca(_folded(network, torch.from_numpy(space.to_weights))), None
    weight, bias = network.decoder.weight.detach(), network.decoder.bias.detach()
    decoder = torch.cat([weight.T, bias[None]]) / MM
    if space is not None:
        decoder = decoder @ torch.from_numpy(space.basis)
    return _Embedding(network), decoder.reshape(len(decoder), -1, 3)


def _folded(network: Voca, to_weights: Tensor) -> Voca:
    """The same network decoding to weights of the corpus's components."""
    from dataclasses import replace

    folded = Voca(replace(network.config, outputs=to_weights.shape[1]))
    state = dict(network.state_dict())
    state["decoder.weight"] = to_weights.T @ state["decoder.weight"]
    state["decoder.bias"] = state["decoder.bias"] @ to_weights
    folded.load_state_dict(state)
    return folded


def _record(
    trained: Trained, corpus: Corpus, components: tuple[str, ...], note: str
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
        "config": trained.config.record(),
        "note": note,
    }
