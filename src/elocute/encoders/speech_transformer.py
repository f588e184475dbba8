"""wav2vec 2.0, HuBERT and WavLM from a local transformers folder: last hidden states at 50 Hz.

Here stands all that needs no torch: checking the folder, normalising, and cutting long sound. The
network itself is `elocute.encoders.speech_transformer_network`, which needs the extra `encoders`
and is imported when the first sound comes. (An export to ONNX would need the same torch once, and a
second file to keep true to the first.)
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from functools import cached_property
from pathlib import Path
from typing import Any, ClassVar

import numpy as np

from elocute.array_types import Float32Array
from elocute.audio.features import Features
from elocute.audio.waveform import SPEECH_RATE, Waveform
from elocute.encoders.protocol import (
    FEATURE_RATE,
    WEIGHTS_MAX_BYTES,
    as_features,
    encoder_samples,
)
from elocute.errors import InputError
from elocute.files.json_records import read_record
from elocute.files.reading import FileKind

HOP = 320  # samples per frame: 20 ms
RECEPTIVE = 400  # samples that one frame needs
BLOCK_FRAMES = 1500
CONTEXT_FRAMES = 250
"""Attention's memory grows with the square of the length, so sound of more than 30 s is read in
blocks of 30 s that see 5 s more on either side."""
SETTINGS_FILE = FileKind("transformers' settings, as JSON", 1_000_000)
# What a folder may ask for: the largest published has 48 layers of 1920.
LARGEST = {
    "hidden_size": 8192,
    "num_hidden_layers": 96,
    "intermediate_size": 32768,
    "num_attention_heads": 128,
    "num_conv_pos_embeddings": 1024,
    "num_conv_pos_embedding_groups": 1024,
    "num_buckets": 4096,
    "adapter_attn_dim": 1024,
}
# transformers' own, where config.json is silent.
CONVOLUTIONS = {
    "conv_dim": [512] * 7,
    "conv_stride": [5, 2, 2, 2, 2, 2, 2],
    "conv_kernel": [10, 3, 3, 3, 3, 2, 2],
}
LAYERS, INNER = 12, 3072
POSITIONS = {"num_conv_pos_embeddings": 128, "num_conv_pos_embedding_groups": 16}
CONVERT = (
    "convert it where you trust it: transformers' "
    "AutoModel.from_pretrained(FOLDER).save_pretrained(OTHER, safe_serialization=True)"
)


class SpeechTransformer:
    """One of the three kinds. Raises InputError for a folder that does not hold it."""

    name: ClassVar[str]
    rate = FEATURE_RATE

    def __init__(self, folder: str | Path) -> None:
        self.folder = Path(folder)
        self.config = read_config(self.folder, self.name)
        self.normalises = _normalises(self.folder)
        _check_weights(self.folder, least_bytes(self.config))

    @property
    def feature_count(self) -> int:
        return self.config["hidden_size"]

    @cached_property
    def _network(self) -> Callable[[Float32Array], Float32Array]:
        """(sample,) to (frame, feature). Raises MachineError without the extra `encoders`."""
        from elocute.encoders.speech_transformer_network import load_speech_transformer

        return load_speech_transformer(self.name, self.config, self.folder / "model.safetensors")

    def __call__(self, waveform: Waveform) -> Features:
        """Raises InputError for weights that do not fit, MachineError without the extra."""
        samples = encoder_samples(waveform)
        if self.normalises:
            samples = (samples - samples.mean()) / np.sqrt(samples.var() + 1e-7)
        values = np.concatenate(
            [self._network(sound)[first:stop] for sound, first, stop in blocks(samples)]
        )
        return as_features(waveform, values, self.name)


class Wav2Vec2(SpeechTransformer):
    """The encoder `wav2vec2:FOLDER` (Baevski et al., 2020)."""

    name = "wav2vec2"


class Hubert(SpeechTransformer):
    """The encoder `hubert:FOLDER` (Hsu et al., 2021)."""

    name = "hubert"


class WavLM(SpeechTransformer):
    """The encoder `wavlm:FOLDER` (Chen et al., 2022)."""

    name = "wavlm"


def blocks(samples: Float32Array) -> Iterator[tuple[Float32Array, int, int | None]]:
    """Sound for one run of the network each, and which of its frames to keep (first, stop)."""
    total = len(samples) // HOP
    if total <= BLOCK_FRAMES:
        yield np.pad(samples, (0, max(0, RECEPTIVE - len(samples)))), 0, None
        return
    for begin in range(0, total, BLOCK_FRAMES):
        end = begin + BLOCK_FRAMES
        start = max(0, begin - CONTEXT_FRAMES)
        sound = samples[start * HOP : (end + CONTEXT_FRAMES) * HOP]
        yield np.pad(sound, (0, max(0, RECEPTIVE - len(sound)))), begin - start, end - start


def read_config(folder: Path, kind: str) -> dict[str, Any]:
    """The folder's config.json. Raises InputError where it is missing, forged or another's."""
    if not folder.is_dir():
        raise InputError.about(
            folder,
            found="no such folder",
            allowed=f"a transformers folder of {kind}",
            remedy="download it first: nothing is fetched from a network",
        )
    path = folder / "config.json"
    config = _read_json(path)
    if config.get("model_type") != kind:
        raise InputError.about(
            path, found=f"model_type {str(config.get('model_type'))[:40]!r}", allowed=repr(kind)
        )
    for field, most in LARGEST.items():
        value = config.get(field, 1)
        if value is None and field == "adapter_attn_dim":
            continue  # as transformers writes it where there is none
        if type(value) is not int or not 0 < value <= most:
            raise InputError.about(
                path, found=f"{field} {repr(value)[:40]}", allowed=f"1 to {most}"
            )
    if "hidden_size" not in config:
        raise InputError.about(path, found="no hidden_size", allowed="a whole config.json")
    _check_frames(path, config)
    return config


def _check_frames(path: Path, config: dict[str, Any]) -> None:
    """The convolutions must give a frame for every 20 ms; 16 layers of 4096 at most."""
    layers = [config.get(field, default) for field, default in CONVOLUTIONS.items()]
    if not all(map(_are_sizes, layers)) or len({len(sizes) for sizes in layers}) > 1:
        raise InputError.about(
            path, found="convolutions that do not fit", allowed=", ".join(CONVOLUTIONS)
        )
    hop = math.prod(config.get("conv_stride", CONVOLUTIONS["conv_stride"]))
    if hop != HOP or config.get("add_adapter"):
        found = "an adapter" if config.get("add_adapter") else f"a frame every {hop} samples"
        raise InputError.about(path, found=found, allowed=f"a frame every {HOP} samples")


def _are_sizes(sizes: Any) -> bool:
    if not isinstance(sizes, list) or not 0 < len(sizes) <= 16:
        return False
    return all(type(size) is int and 0 < size <= 4096 for size in sizes)


def least_bytes(config: dict[str, Any]) -> int:
    """What the weights must at least weigh, at one byte a number.

    A forged configuration could ask for any memory; its weights file cannot be forged as large.
    """
    width = config["hidden_size"]
    layer = width * (4 * width + 2 * config.get("intermediate_size", INNER))
    dims = config.get("conv_dim", CONVOLUTIONS["conv_dim"])
    kernels = config.get("conv_kernel", CONVOLUTIONS["conv_kernel"])
    pairs = zip([1, *dims], dims, kernels, strict=False)  # the last width has no layer after it
    convolutions = sum(before * after * kernel for before, after, kernel in pairs)
    layer += 2 * width * (config.get("adapter_attn_dim") or 0)
    kernel, groups = (config.get(field, default) for field, default in POSITIONS.items())
    positions = width * (width // groups) * kernel
    return config.get("num_hidden_layers", LAYERS) * layer + convolutions + positions


def _normalises(folder: Path) -> bool:
    """Whether the network wants sound of mean 0 and variance 1: what preprocessor_config.json
    says; where it is absent, yes, which is transformers' own default."""
    path = folder / "preprocessor_config.json"
    if not path.exists():
        return True
    settings = _read_json(path)
    rate = settings.get("sampling_rate", SPEECH_RATE)
    if rate != SPEECH_RATE:
        raise InputError.about(
            path, found=f"sampling_rate {repr(rate)[:40]}", allowed=str(SPEECH_RATE)
        )
    return bool(settings.get("do_normalize", True))


def _check_weights(folder: Path, least: int) -> None:
    path = folder / "model.safetensors"
    if path.is_file():
        size = path.stat().st_size
        if not least <= size <= WEIGHTS_MAX_BYTES:
            raise InputError.about(
                path,
                found=f"{size} bytes",
                allowed=f"{least} to {WEIGHTS_MAX_BYTES} bytes",
                remedy="config.json and the weights must belong together",
            )
        return
    if (folder / "pytorch_model.bin").exists():
        raise InputError.about(
            folder / "pytorch_model.bin",
            found="a pickle, which could run any code",
            allowed="model.safetensors",
            remedy=CONVERT,
        )
    raise InputError.about(folder, found="no model.safetensors", allowed="weights in one such file")


def _read_json(path: Path) -> dict[str, Any]:
    return read_record(path, SETTINGS_FILE)
