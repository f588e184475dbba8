"""Weights of a published Whisper encoder, from the files that people have.

Read are the `model.bin` of CTranslate2 and the `.pt` of OpenAI. Neither is unpickled by Python's
own unpickler.
"""

from __future__ import annotations

import hashlib
import re
import struct
from pathlib import Path
from typing import BinaryIO

import numpy as np
import torch
from torch import Tensor

from recipes.trunk.network import Trunk

STORED_AS = {0: np.float32, 1: np.int8, 2: np.int16, 3: np.int32, 4: np.float16}
SHA_256 = {
    "d01c3014881c9c6f3133c182f3d2887eb6ca1c789a7538c5c007196857a0a6a9": "base, CTranslate2 fp16",
}
LAYER_PARTS = {
    "self_attention/layer_norm/gamma": "attention_norm.weight",
    "self_attention/layer_norm/beta": "attention_norm.bias",
    "self_attention/linear_0/weight": "attend.weight",
    "self_attention/linear_0/bias": "attend.bias",
    "self_attention/linear_1/weight": "leave.weight",
    "self_attention/linear_1/bias": "leave.bias",
    "ffn/layer_norm/gamma": "forward_norm.weight",
    "ffn/layer_norm/beta": "forward_norm.bias",
    "ffn/linear_0/weight": "widen.weight",
    "ffn/linear_0/bias": "widen.bias",
    "ffn/linear_1/weight": "narrow.weight",
    "ffn/linear_1/bias": "narrow.bias",
}
OPENAI_PARTS = {
    "attn_ln": "attention_norm",
    "attn.out": "leave",
    "mlp_ln": "forward_norm",
    "mlp.0": "widen",
    "mlp.2": "narrow",
}
FRONT = {"conv1": "first", "conv2": "second"}


def load_whisper(trunk: Trunk, path: Path) -> str:
    """Give a trunk the weights of a Whisper encoder; returns what the file is known as."""
    if path.is_dir():
        path = path / "model.bin"
    state = _openai_state(path) if path.suffix == ".pt" else _ctranslate2_state(path)
    heads = ("mouth.", "live_mouth.", "phones.")
    wanted = [name for name in trunk.state_dict() if not name.startswith(heads)]
    missing = [name for name in wanted if name not in state]
    if missing:
        raise SystemExit(f"{path}: no {missing[0]}; allowed: a Whisper of the trunk's width")
    trunk.load_state_dict({name: state[name] for name in wanted}, strict=False)
    return SHA_256.get(hashlib.sha256(path.read_bytes()).hexdigest(), "unknown to this recipe")


def _ctranslate2_state(path: Path) -> dict[str, Tensor]:
    state: dict[str, Tensor] = {}
    stored = _ctranslate2_arrays(path)
    for name, array in stored.items():
        if array.dtype == np.int8 and f"{name}_scale" in stored:
            array = array * stored[f"{name}_scale"].astype(np.float32)[:, None]
        values = torch.from_numpy(np.array(array, np.float32))
        if layer := re.fullmatch(r"encoder/layer_(\d+)/(.+)", name):
            if layer[2] in LAYER_PARTS:
                state[f"layers.{layer[1]}.{LAYER_PARTS[layer[2]]}"] = values
        elif front := re.fullmatch(r"encoder/(conv\d)/(weight|bias)", name):
            state[f"{FRONT[front[1]]}.{front[2]}"] = values
    return state


def _ctranslate2_arrays(path: Path) -> dict[str, np.ndarray]:
    with path.open("rb") as file:
        _number(file, "I")
        _text(file)
        _number(file, "I")
        arrays = {}
        for _ in range(_number(file, "I")):
            name = _text(file)
            shape = [_number(file, "I") for _ in range(_number(file, "B"))]
            kind, size = _number(file, "B"), _number(file, "I")
            data = file.read(size)
            if kind in STORED_AS:
                arrays[name] = np.frombuffer(data, STORED_AS[kind]).reshape(shape)
    return arrays


def _number(file: BinaryIO, code: str) -> int:
    return struct.unpack(f"<{code}", file.read(struct.calcsize(f"<{code}")))[0]


def _text(file: BinaryIO) -> str:
    return file.read(_number(file, "H")).rstrip(b"\0").decode()


def _openai_state(path: Path) -> dict[str, Tensor]:
    loaded = torch.load(path, map_location="cpu", weights_only=True)["model_state_dict"]
    encoder = {
        name.removeprefix("encoder."): values.float()
        for name, values in loaded.items()
        if name.startswith("encoder.")
    }
    state: dict[str, Tensor] = {}
    for name, values in encoder.items():
        block = re.fullmatch(r"blocks\.(\d+)\.(.+)\.(weight|bias)", name)
        if block and block[2] in OPENAI_PARTS:
            state[f"layers.{block[1]}.{OPENAI_PARTS[block[2]]}.{block[3]}"] = values
        elif (front := name.partition("."))[0] in FRONT:
            state[f"{FRONT[front[0]]}.{front[2]}"] = values
    for layer in {name.split(".")[1] for name in encoder if name.startswith("blocks.")}:
        part = f"blocks.{layer}.attn."
        query = encoder[f"{part}query.bias"]
        biases = [query, torch.zeros_like(query), encoder[f"{part}value.bias"]]
        weights = [encoder[f"{part}{name}.weight"] for name in ("query", "key", "value")]
        state[f"layers.{layer}.attend.weight"] = torch.cat(weights)
        state[f"layers.{layer}.attend.bias"] = torch.cat(biases)
    return state
