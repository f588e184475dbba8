"""Devices by name: what is there is taken, what is not is one line."""

from __future__ import annotations

import pytest

pytest.importorskip("torch", reason="needs the extra `train`")

import torch

from elocute.errors import ModelError
from elocute.training.device import available_devices, resolve_device


def test_names_lead_to_devices_that_are_there() -> None:
    there = available_devices()
    assert there[0] == "cpu"
    assert resolve_device("cpu") == torch.device("cpu")
    assert str(resolve_device("auto")) == ("cuda:0" if torch.cuda.is_available() else "cpu")
    for name in there:
        assert str(resolve_device(name)) == name


def test_what_is_not_there_is_told_with_what_is() -> None:
    with pytest.raises(ModelError, match=r"cuda:99: no such device here; allowed: auto, cpu"):
        resolve_device("cuda:99")
    if not torch.cuda.is_available():
        with pytest.raises(ModelError, match="`device` cuda: no such device here"):
            resolve_device("cuda")
    for name in ("gpu", "cuda:x", "", "cuda:-1", "CPU"):
        with pytest.raises(ModelError, match="no device; allowed: auto, cpu, cuda, cuda:N, mps"):
            resolve_device(name)
