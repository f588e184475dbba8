"""From a trained network to one ONNX file that needs no torch."""

from __future__ import annotations

import json
import warnings
from pathlib import Path
from typing import Any

import torch
from torch import Tensor, nn

from elocute.corpus.store import Corpus
from elocute.motion.atomic import write_atomically
from elocute.networks.voca import SharedVoca, Voca
from elocute.training.voca.fit import Trained

OPSET = 17
MM = 1000.0


class _WithBasis(nn.Module):
    """Features and a style to weights; the basis they weigh is a second, constant output.

    A decoder is linear, so its columns are the basis and its bias a shape whose weight is one.
    """

    def __init__(self, voca: Voca, basis: Tensor) -> None:
        super().__init__()
        self.shared = SharedVoca(voca)
        self.register_buffer("basis", basis)

    def forward(self, features: Tensor, style: Tensor) -> tuple[Tensor, Tensor]:
        embedded = self.shared.embed(features, style)
        return torch.nn.functional.pad(embedded, (0, 1), value=1.0), torch.mul(self.basis, 1.0)  # pyright: ignore


def export_onnx(trained: Trained, corpus: Corpus, path: Path, note: str = "") -> None:
    """Write the network in its shared-window form, its configuration in the metadata.

    A corpus with weights gives weights of the same components; one with vertices gives weights
    of the model's own basis, which the file carries. Raises OutputError.
    """
    import onnx

    module, components = _runnable(trained, corpus)
    features = torch.zeros(40, trained.network.config.features)
    style = torch.zeros(1, trained.network.config.styles)
    outputs = ["weights"] if components else ["weights", "basis"]
    with write_atomically(path) as draft:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")
            torch.onnx.export(
                module.eval(), (features, style), str(draft), input_names=["features", "style"],
                output_names=outputs, opset_version=OPSET, dynamo=False,
                dynamic_axes={"features": {0: "frame"}, "weights": {0: "frame"}},
            )  # fmt: skip
        model = onnx.load(draft)
        entry = model.metadata_props.add()
        entry.key, entry.value = "elocute", json.dumps(_record(trained, corpus, components, note))
        onnx.save(model, draft)


def _runnable(trained: Trained, corpus: Corpus) -> tuple[nn.Module, tuple[str, ...]]:
    network, space = trained.network, trained.space
    if space is not None and space.to_weights is not None:
        return SharedVoca(_folded(network, torch.from_numpy(space.to_weights))), corpus.components
    weight, bias = network.decoder.weight.detach(), network.decoder.bias.detach()
    decoder = torch.cat([weight.T, bias[None]]) / MM
    if space is not None:
        decoder = decoder @ torch.from_numpy(space.basis)
    return _WithBasis(network, decoder.reshape(len(decoder), -1, 3)), ()


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
        "kind": "voca", "version": 1, "encoder": trained.config.encoder, "fps": trained.fps,
        "styles": trained.styles, "features": trained.network.config.features,
        "components": components, "topology": corpus.topology, "vertices": corpus.vertex_count,
        "config": trained.config.record(), "note": note,
    }  # fmt: skip
