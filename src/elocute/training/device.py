"""Chooses the device that a training computes on."""

from __future__ import annotations

import re
from collections.abc import Callable

import torch

from elocute.errors import ModelError

NAMES = re.compile(r"auto|cpu|mps|cuda(:\d{1,3})?")


def resolve_device(name: str = "auto") -> torch.device:
    """The device called `auto`, `cpu`, `cuda`, `cuda:N` or `mps`; cuda is the first one.

    `auto` is the first CUDA device, or the CPU where there is none. MPS is used only on request:
    nobody has measured these trainings on it. Raises ModelError for an unknown name, and for a
    device that this machine, or the installed torch, lacks.
    """
    there = available_devices()
    if not NAMES.fullmatch(name):
        raise ModelError.about(
            f"`device` {name[:40]}", found="no device", allowed="auto, cpu, cuda, cuda:N, mps"
        )
    wanted = {"auto": "cuda:0" if "cuda:0" in there else "cpu", "cuda": "cuda:0"}.get(name, name)
    if wanted not in there:
        raise ModelError.about(
            f"`device` {name}",
            found="no such device here",
            allowed=f"auto, {', '.join(there)}",
            remedy=_remedy(wanted),
        )
    return torch.device(wanted)


def available_devices() -> list[str]:
    """Names of the devices that a training could use, the CPU first."""
    cuda = [f"cuda:{number}" for number in range(torch.cuda.device_count())]
    usable = cuda if torch.cuda.is_available() else []
    return ["cpu", *usable, *(["mps"] if torch.backends.mps.is_available() else [])]


def by_first_process(write: Callable[[], None]) -> None:
    """Have one of the processes that train together write, while the others wait for it."""
    together = torch.distributed.is_available() and torch.distributed.is_initialized()
    if not together or torch.distributed.get_rank() == 0:
        write()
    if together:
        torch.distributed.barrier()


def _remedy(wanted: str) -> str:
    built = (
        torch.version.cuda is not None
        if wanted.startswith("cuda")
        else (torch.backends.mps.is_built())
    )
    if built:
        return ""
    return f"torch {torch.__version__} is built without {wanted.split(':')[0]}"
