"""Networks, checkpoints and folders of speech encoders."""

from __future__ import annotations

import json
import shutil
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np

from tests.fuzz.fuzzing.seeds.making import ROOT, place


def frozen_graphs(folder: Path) -> None:
    """DeepSpeech's node names around a few units."""
    from elocute.files.protobuf import write_message

    inputs, hidden, letters = 494, 2, 29
    sizes = {
        "1": (inputs, hidden),
        "2": (hidden, hidden),
        "3": (hidden, 2 * hidden),
        "5": (2 * hidden, hidden),
        "6": (hidden, letters),
    }
    arrays = {f"h{layer}": np.full(size, 0.1, "<f4") for layer, size in sizes.items()}
    arrays |= {f"b{layer}": np.zeros(size[1], "<f4") for layer, size in sizes.items()}
    for way in ("fw", "bw"):
        cell = f"bidirectional_rnn/{way}/basic_lstm_cell"
        arrays[f"{cell}/kernel"] = np.full((3 * hidden, 4 * hidden), 0.1, "<f4")
        arrays[f"{cell}/bias"] = np.zeros(4 * hidden, "<f4")

    def node(name: str, operation: str, array: np.ndarray | None = None) -> bytes:
        fields: list[tuple[int, Any]] = [(1, name), (2, operation)]
        if array is not None:
            shape = write_message(*((2, write_message((1, size))) for size in array.shape))
            tensor = write_message((1, 1), (2, shape), (4, array.tobytes()))
            fields.append((5, write_message((1, "value"), (2, write_message((8, tensor))))))
        return write_message((1, write_message(*fields)))

    nodes = [node(name, "Placeholder") for name in ("input_node", "input_lengths")]
    nodes += [node("logits", "Identity")]
    nodes += [node(name, "Const", array) for name, array in arrays.items()]
    (place(folder, "one") / "output_graph.pb").write_bytes(b"".join(nodes))


def shipped(*names: str):
    """Copies of networks that ship."""

    def copy(folder: Path) -> None:
        for path in (ROOT / "src" / "elocute").rglob("*.onnx"):
            if path.name in names:
                shutil.copy(path, place(folder, path.stem) / path.name)

    return copy


def trunks(folder: Path) -> None:
    """A narrow trunk of one layer: what is judged is what is made of a file, not its weights.

    The one that ships is 14 MB, which are written, read and run for every case.
    """
    import torch

    from recipes.trunk.export import export, scales
    from recipes.trunk.network import CONTEXT, Trunk, TrunkConfig

    torch.manual_seed(0)
    trunk = Trunk(
        TrunkConfig(
            width=16,
            layers=1,
            mouth_layer=1,
            heads=2,
            history=20,
            period=50,
            mouth_channels=8,
            phone_channels=8,
        )
    ).eval()
    record = {
        "kind": "trunk",
        "middle_mm": [6.7, 50.0, 0.0, 3.4],
        "spread_mm": [4.5, 4.2, 0.9, 3.7],
        "note": "a seed",
    }
    bands = torch.randn(1, 40 + 2 * CONTEXT - 1, 80)
    export(trunk, place(folder, "one") / "trunk.onnx", record, scales(trunk, [bands]))


def checkpoints(folder: Path) -> None:
    """As `train voca` leaves them, of a network of eight numbers."""
    import torch

    from elocute.training.checkpoint import network_tensors, save_checkpoint
    from elocute.training.voca.settings import VocaTrainConfig

    torch.manual_seed(0)
    network = torch.nn.Linear(3, 2)
    optimiser = torch.optim.Adam(network.parameters())
    network(torch.ones(1, 3)).sum().backward()
    optimiser.step()
    record = {
        "config": asdict(VocaTrainConfig()),
        "styles": ["anna"],
        "fps": 60.0,
        "log": [{"epoch": 1, "train_mm2": 0.5}],
    }
    path = place(folder, "one") / "checkpoint.safetensors"
    save_checkpoint(path, network_tensors(network, optimiser), record)


def crnn_checkpoints(folder: Path) -> None:
    """As `train crnn` leaves them, of the same network."""
    import torch

    from elocute.training.checkpoint import network_tensors, save_checkpoint
    from elocute.training.crnn.settings import CrnnTrainConfig

    torch.manual_seed(0)
    network = torch.nn.Linear(3, 2)
    optimiser = torch.optim.Adam(network.parameters())
    network(torch.ones(1, 3)).sum().backward()
    optimiser.step()
    tensors = network_tensors(network, optimiser)
    tensors |= {f"best.{name}": value.clone() for name, value in network.state_dict().items()}
    log = [{"epoch": 1.0, "validation_loss": 0.5}]
    record = {"kind": "crnn", "config": asdict(CrnnTrainConfig()), "log": log, "clips": [2, 1]}
    save_checkpoint(place(folder, "one") / "checkpoint.safetensors", tensors, record)


TINY = {
    "model_type": "wav2vec2",
    "hidden_size": 24,
    "num_hidden_layers": 2,
    "num_attention_heads": 2,
    "intermediate_size": 32,
    "conv_dim": [16] * 7,
    "num_conv_pos_embeddings": 16,
    "num_conv_pos_embedding_groups": 2,
    "vocab_size": 32,
    "conv_stride": [5, 2, 2, 2, 2, 2, 2],
    "conv_kernel": [10, 3, 3, 3, 3, 2, 2],
}


def transformer_folders(folder: Path) -> None:
    """The settings of a small network; its weights are only weighed here."""
    inner = place(folder, "one")
    (inner / "config.json").write_text(json.dumps(TINY))
    (inner / "preprocessor_config.json").write_text(
        '{"sampling_rate": 16000, "do_normalize": true}'
    )
    (inner / "model.safetensors").write_bytes(bytes(20_000))


def transformer_networks(folder: Path) -> None:
    import torch
    from transformers import Wav2Vec2Config, Wav2Vec2Model

    torch.manual_seed(0)
    settings = {name: value for name, value in TINY.items() if name != "model_type"}
    Wav2Vec2Model(Wav2Vec2Config(**settings)).save_pretrained(place(folder, "one"))
