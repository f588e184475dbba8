"""Checkpoints: safetensors with their settings inside, written whole or not at all."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from elocute.errors import ModelError, OutputError
from elocute.files.atomic import write_atomically

FILE_MAX_BYTES = 4_000_000_000


def save_checkpoint(path: Path, tensors: dict[str, Tensor], record: dict[str, Any]) -> None:
    """Write tensors and a JSON record. Raises OutputError where the disk refuses."""
    from safetensors import SafetensorError
    from safetensors.torch import save_file

    with write_atomically(path) as draft:
        flat = {name: tensor.detach().contiguous().cpu() for name, tensor in tensors.items()}
        try:
            save_file(flat, draft, {"elocute": json.dumps(record)})
        except SafetensorError as error:
            raise OutputError.about(path, found=f"cannot be written ({error})") from error


def load_checkpoint(path: Path) -> tuple[dict[str, Tensor], dict[str, Any]]:
    """Read what `save_checkpoint` wrote. Raises ModelError."""
    from safetensors import SafetensorError, safe_open

    if not path.is_file():
        raise ModelError.about(path, found="no such file", allowed="a checkpoint (.safetensors)")
    if path.stat().st_size > FILE_MAX_BYTES:
        raise ModelError.about(path, found="more than 4 GB", allowed="a checkpoint")
    try:
        with safe_open(path, framework="pt") as stored:
            record = json.loads((stored.metadata() or {})["elocute"])
            return {name: stored.get_tensor(name) for name in stored.keys()}, record  # noqa: SIM118
    except (SafetensorError, OSError, KeyError, ValueError) as error:
        raise ModelError.about(
            path, found="no checkpoint that can be read", allowed="a file that training wrote"
        ) from error


def optimiser_tensors(optimiser: torch.optim.Optimizer) -> dict[str, Tensor]:
    """Adam's moments and steps, flat by parameter number."""
    states = optimiser.state_dict()["state"]
    return {
        f"optimiser.{index}.{name}": value
        for index, state in states.items()
        for name, value in state.items()
    }


def restore_optimiser(optimiser: torch.optim.Optimizer, tensors: dict[str, Tensor]) -> None:
    """The inverse of `optimiser_tensors`."""
    state: dict[int, dict[str, Tensor]] = {}
    for key, value in tensors.items():
        head, _, rest = key.partition(".")
        if head == "optimiser":
            index, _, name = rest.partition(".")
            state.setdefault(int(index), {})[name] = value
    optimiser.load_state_dict({**optimiser.state_dict(), "state": state})


def network_tensors(
    network: torch.nn.Module, optimiser: torch.optim.Optimizer
) -> dict[str, Tensor]:
    """Everything that a training goes on from."""
    state = {f"network.{name}": value for name, value in network.state_dict().items()}
    return {**state, **optimiser_tensors(optimiser)}


def restore_network(path: Path, network: torch.nn.Module, tensors: dict[str, Tensor]) -> None:
    """The network's part of `network_tensors`. Raises ModelError where a shape differs."""
    state = {k.removeprefix("network."): v for k, v in tensors.items() if k.startswith("network.")}
    for name, value in network.state_dict().items():
        if name not in state or state[name].shape != value.shape:
            found = tuple(state[name].shape) if name in state else "nothing"
            raise ModelError.about(
                path, found=f"{name} of shape {found}", allowed=str(tuple(value.shape)),
                remedy="what it learns from has changed: choose another output folder",
            )  # fmt: skip
    network.load_state_dict(state)
