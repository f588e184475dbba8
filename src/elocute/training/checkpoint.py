"""Checkpoints: tensors and settings in one safetensors file, written whole or not at all."""

from __future__ import annotations

import json
from collections.abc import Container
from pathlib import Path
from typing import Any

import torch
from torch import Tensor

from elocute.errors import ModelError, OutputError
from elocute.files.atomic import write_atomically
from elocute.files.json_records import as_record, finite_number, parse_json
from elocute.files.reading import FileKind
from elocute.files.safetensors_header import read_tensor_header
from elocute.files.work_folder import CHECKPOINT

FILE_MAX_BYTES = 4_000_000_000


def save_checkpoint(path: Path, tensors: dict[str, Tensor], record: dict[str, Any]) -> None:
    """Write tensors and a JSON record. Raises OutputError where it cannot be written."""
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
    from safetensors import SafetensorError

    allowed = "a checkpoint (.safetensors) that training wrote"
    header = read_tensor_header(path, FileKind(allowed, FILE_MAX_BYTES, ModelError))
    text = header.metadata.get("elocute", "")
    record = as_record(
        parse_json(text, path, allowed=allowed, error=ModelError, nan=True),
        path,
        allowed,
        ModelError,
    )
    try:
        stored = _stored_tensors(path)
        tensors = {name: stored[name] for name in header.shapes}
    except (SafetensorError, OSError, ValueError, KeyError) as error:
        raise ModelError.about(
            path, found="no checkpoint that can be read", allowed=allowed
        ) from error
    for name, tensor in tensors.items():
        if not torch.isfinite(tensor).all():
            raise ModelError.about(path, found=f"NaN or infinity in {name}", allowed=allowed)
    return tensors, record


def _stored_tensors(path: Path) -> dict[str, Tensor]:
    from safetensors.torch import load, load_file

    try:
        str(path).encode()
    except UnicodeEncodeError:  # a name that safetensors cannot open
        return load(path.read_bytes())
    return load_file(path)


def check_checkpoint(folder: Path) -> None:
    """Refuse a checkpoint that cannot be read before hours are spent. Raises ModelError."""
    if (folder / CHECKPOINT).exists():
        load_checkpoint(folder / CHECKPOINT)


def stored_log(path: Path, record: dict[str, Any]) -> list[dict[str, float]]:
    """The rows of a checkpoint's log. Raises ModelError where it has no log."""
    log = record.get("log")
    if not isinstance(log, list) or not all(map(_is_row, log)):
        raise ModelError.about(path, found="no log in it", allowed="a checkpoint of a training")
    return log


def _is_row(row: Any) -> bool:
    """Numbers by name; NaN stands where there was nothing to validate on."""
    return isinstance(row, dict) and all(
        finite_number(value) is not None or value != value for value in row.values()
    )


def optimiser_tensors(optimiser: torch.optim.Optimizer) -> dict[str, Tensor]:
    """Adam's moments and steps, flat by parameter number."""
    states = optimiser.state_dict()["state"]
    return {
        f"optimiser.{index}.{name}": value
        for index, state in states.items()
        for name, value in state.items()
    }


def restore_optimiser(
    path: Path, optimiser: torch.optim.Optimizer, tensors: dict[str, Tensor]
) -> None:
    """The inverse of `optimiser_tensors`. Raises ModelError where a moment has another shape."""
    parameters = [p for group in optimiser.param_groups for p in group["params"]]
    state: dict[int, dict[str, Tensor]] = {}
    for key, value in tensors.items():
        head, _, rest = key.partition(".")
        if head == "optimiser":
            index, _, name = rest.partition(".")
            known = index in map(str, range(len(parameters)))
            if not known or value.shape not in ((), parameters[int(index)].shape):
                raise ModelError.about(
                    path,
                    found=f"{key[:80]} of shape {tuple(value.shape)}",
                    allowed="the optimiser's moments",
                    remedy="choose another output folder",
                )
            state.setdefault(int(index), {})[name] = value
    if any(set(moments) != {"step", "exp_avg", "exp_avg_sq"} for moments in state.values()):
        raise ModelError.about(path, found="moments that are missing", allowed="those of Adam")
    optimiser.load_state_dict({**optimiser.state_dict(), "state": state})


def network_tensors(
    network: torch.nn.Module, optimiser: torch.optim.Optimizer
) -> dict[str, Tensor]:
    """Everything that a resumed training starts from."""
    state = {f"network.{name}": value for name, value in network.state_dict().items()}
    return {**state, **optimiser_tensors(optimiser)}


def restore_training(
    path: Path,
    network: torch.nn.Module,
    optimiser: torch.optim.Optimizer,
    record: dict[str, Any],
    *,
    source: str = "corpus",
    free: Container[str] = ("epochs",),
) -> tuple[list[dict[str, float]], dict[str, Tensor]]:
    """The inverse of `network_tensors`: the log and all tensors of a checkpoint, taken up.

    record: what the training at hand would write beside its log. source: what it learns from.
    free: settings that may differ. Raises ModelError where another one does, or a shape.
    """
    tensors, stored = load_checkpoint(path)
    _check_same_training(path, stored, json.loads(json.dumps(record)), source, free)
    state = tensors_of(tensors, "network")
    check_state(path, network, state)
    network.load_state_dict(state)
    restore_optimiser(path, optimiser, tensors)
    return stored_log(path, stored), tensors


def tensors_of(tensors: dict[str, Tensor], part: str) -> dict[str, Tensor]:
    """Tensors by their names in one part of a checkpoint: "network", "best"."""
    prefix = f"{part}."
    return {k.removeprefix(prefix): v for k, v in tensors.items() if k.startswith(prefix)}


def _check_same_training(
    path: Path, stored: dict[str, Any], record: dict[str, Any], source: str, free: Container[str]
) -> None:
    """Raise ModelError for a checkpoint of another training: names what differs."""
    stored_config, config = stored.get("config"), record["config"]
    known = stored_config if isinstance(stored_config, dict) else {}
    settings = [name for name in {**config, **known} if name not in free]
    differing = [name for name in settings if known.get(name) != config.get(name)]
    differing += [name for name in record if name != "config" and stored.get(name) != record[name]]
    if differing:
        raise ModelError.about(
            path,
            found=f"a training with other {', '.join(differing)}",
            allowed=f"the same settings and {source}",
            remedy="choose another output folder",
        )


def check_state(path: Path, network: torch.nn.Module, state: dict[str, Tensor]) -> None:
    """Raise ModelError where `state` is not all of the network's weights and nothing else."""
    unknown = sorted(set(state) - set(network.state_dict()))
    if unknown:
        raise ModelError.about(path, found=f"{unknown[0][:80]}", allowed="the network's weights")
    for name, value in network.state_dict().items():
        if name not in state or state[name].shape != value.shape:
            shape = tuple(state[name].shape) if name in state else "nothing"
            raise ModelError.about(
                path,
                found=f"{name} of shape {shape}",
                allowed=str(tuple(value.shape)),
                remedy="what it learns from has changed: choose another output folder",
            )
