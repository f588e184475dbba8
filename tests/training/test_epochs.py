"""What stands around the epochs of every training, seen on a network of eight numbers."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest

pytest.importorskip("torch", reason="needs the extra `train`")
pytest.importorskip("tensorboard", reason="needs the extra `train`")

import torch

from elocute.errors import ModelError
from elocute.training.checkpoint import network_tensors, restore_training
from elocute.training.epochs import Row, checkpoint_to_resume, run_epochs

RECORD: dict[str, Any] = {"config": {"epochs": 4, "rate": 0.1}, "styles": ("anna",)}
FIELDS = ("epoch", "loss", "seconds")


def losses(folder: Path | None, epochs: int, *, resume: bool = False, seed: int = 0) -> list[float]:
    """Of a training of a line to three noisy points, drawn anew in every epoch."""
    torch.manual_seed(seed)
    network = torch.nn.Linear(3, 2)
    optimiser = torch.optim.Adam(network.parameters(), 0.1)
    log = list[Row]()
    if checkpoint := checkpoint_to_resume(folder, resume):
        log, _ = restore_training(checkpoint, network, optimiser, RECORD)

    def train(epoch: int) -> Row:
        inputs = torch.rand(3, 3, generator=torch.Generator().manual_seed(epoch))
        loss = (network(inputs) - inputs.sum(dim=1, keepdim=True)).square().mean()
        optimiser.zero_grad()
        loss.backward()
        optimiser.step()
        return {"loss": loss.item()}

    told: list[tuple[float, str]] = []
    run_epochs(
        log,
        epochs,
        train,
        lambda: network_tensors(network, optimiser),
        folder=folder,
        fields=FIELDS,
        record=RECORD,
        describe=lambda row: f"loss {row['loss']:.3f}",
        report=lambda share, line: told.append((share, line)),
    )
    assert told[-1][0] == 1.0
    assert told[-1][1].startswith(f"epoch {epochs}: loss {log[-1]['loss']:.3f} (")
    return [row["loss"] for row in log]


def test_losses_are_the_same_to_the_bit_resumed_or_not(tmp_path: Path) -> None:
    whole = losses(None, 4)
    assert losses(tmp_path, 2) == whole[:2]
    assert losses(tmp_path, 4, resume=True) == whole
    assert (tmp_path / "log.csv").read_text().count("\n") == 5
    assert losses(None, 4, seed=1) != whole


@pytest.mark.parametrize(
    ("changed", "named"),
    [
        ({"config": {"epochs": 9, "rate": 0.2}}, "other rate;"),
        ({"config": {"epochs": 9, "rate": 0.1, "decay": 1}}, "other decay;"),
        ({"styles": ("anna", "berta")}, "other styles;"),
    ],
)
def test_a_checkpoint_of_another_training_is_refused(
    tmp_path: Path, changed: dict[str, Any], named: str
) -> None:
    losses(tmp_path, 1)
    network = torch.nn.Linear(3, 2)
    optimiser = torch.optim.Adam(network.parameters())
    path = checkpoint_to_resume(tmp_path, True)
    assert path is not None
    with pytest.raises(ModelError, match=named):
        restore_training(path, network, optimiser, {**RECORD, **changed})
