"""Networks, checkpoints and folders of speech encoders."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

from tests.fuzz.fuzzing import seeds
from tests.fuzz.fuzzing.cases import Reader
from tests.fuzz.fuzzing.readers.one_file import only


def _deepspeech(path: Path) -> None:
    from elocute.audio.waveform import Waveform
    from elocute.encoders.deepspeech import DeepSpeech

    DeepSpeech(path)(Waveform(seeds.tone(), seeds.RATE))


def _model(path: Path) -> None:
    from elocute.audio.waveform import Waveform
    from elocute.models.feature_extraction import extract_features
    from elocute.models.protocol import FrameSpan
    from elocute.models.registry import open_model

    # As `animate` does it, but for what does not depend on the file: contacts, life, and what the
    # trunk hears, a third of the time of a case.
    model, voca = open_model(path), path.stem == "voca"
    speech, _ = extract_features(
        model,
        Waveform(seeds.tone(), seeds.RATE),
        contacts=False,
        phones=[(0.0, 0.2, "AA")] if voca else None,
    )
    style = model.style("even" if voca else "plain")
    model.curves(speech, style, FrameSpan(0, 6, 30.0), contacts=False)


def _trunk(path: Path) -> None:
    from elocute.encoders.phone_encoder import PhoneEncoder

    PhoneEncoder(path).encode(seeds.tone())


def _checkpoint(path: Path) -> None:
    import torch

    from elocute.training.checkpoint import restore_training
    from elocute.training.voca.fit import checkpoint_record
    from elocute.training.voca.settings import VocaTrainConfig

    network: Any = torch.nn.Linear(3, 2)
    optimiser = torch.optim.Adam(network.parameters())
    material: Any = SimpleNamespace(styles=("anna",), fps=60.0)
    record = checkpoint_record(material, VocaTrainConfig())
    restore_training(path, network, optimiser, record)


def _crnn_checkpoint(path: Path) -> None:
    import torch

    from elocute.training.crnn.fit import restore_crnn
    from elocute.training.crnn.settings import CrnnTrainConfig

    network: Any = torch.nn.Linear(3, 2)
    optimiser = torch.optim.Adam(network.parameters())
    data: Any = SimpleNamespace(train=(0, 1), validation=(2,))
    restore_crnn(path, network, optimiser, data, CrnnTrainConfig())


def _transformer(folder: Path, _out: Path) -> None:
    from elocute.encoders.speech_transformer import Wav2Vec2

    _ = Wav2Vec2(folder).feature_count


def _transformer_network(folder: Path, _out: Path) -> None:
    from elocute.audio.waveform import Waveform
    from elocute.encoders.speech_transformer import Wav2Vec2

    Wav2Vec2(folder)(Waveform(seeds.tone(), seeds.RATE))


_JSON = {"*.json": "json"}

READERS: tuple[Reader, ...] = (
    Reader(
        "frozen graph",
        seeds.frozen_graphs,
        only(_deepspeech),
        {"*.pb": "proto"},
        ("elocute.encoders.deepspeech",),
    ),
    Reader(
        "model",
        seeds.shipped("voca.onnx", "crnn.onnx"),
        only(_model),
        {"*.onnx": "proto"},
        ("elocute.models.feature_extraction", "elocute.models.registry"),
        short=30,
    ),
    Reader(
        "trunk",
        seeds.trunks,
        only(_trunk),
        {"*.onnx": "proto"},
        ("elocute.encoders.trunk",),
        needs=("onnx", "torch"),
    ),
    Reader(
        "checkpoint",
        seeds.checkpoints,
        only(_checkpoint),
        {"*.safetensors": "safetensors"},
        ("elocute.training.voca.fit", "torch._dynamo"),
        needs=("torch", "safetensors", "lightning_fabric"),
    ),
    Reader(
        "transformer",
        seeds.transformer_folders,
        _transformer,
        _JSON,
        ("elocute.encoders.speech_transformer",),
    ),
    Reader(
        "transformer network",
        seeds.transformer_networks,
        _transformer_network,
        {"*.json": "json", "*.safetensors": "safetensors"},
        ("elocute.encoders.speech_transformer", "elocute.encoders.speech_transformer_network"),
        needs=("torch", "transformers"),
        short=0,
    ),
    Reader(
        "crnn checkpoint",
        seeds.crnn_checkpoints,
        only(_crnn_checkpoint),
        {"*.safetensors": "safetensors"},
        ("elocute.training.crnn.fit", "torch._dynamo"),
        needs=("torch", "safetensors", "lightning_fabric", "pyarrow"),
    ),
)
