"""The log of a training: log.csv, and events for TensorBoard."""

from __future__ import annotations

import csv
from collections.abc import Sequence
from pathlib import Path

from elocute.files.atomic import write_atomically


class Board:
    """fields: columns, the first of them the epoch; done: epochs logged by a training before."""

    def __init__(self, folder: Path, fields: Sequence[str], done: int) -> None:
        from torch.utils.tensorboard import SummaryWriter

        self.folder, self.fields = folder, tuple(fields)
        self.events = SummaryWriter(folder / "events", purge_step=done)

    def add(self, log: Sequence[dict[str, float]]) -> None:
        """Write the whole table anew, and the last row as an event."""
        with (
            write_atomically(self.folder / "log.csv") as draft,
            draft.open("w", newline="", encoding="utf-8") as file,
        ):
            rows = csv.DictWriter(file, self.fields)
            rows.writeheader()
            rows.writerows(log)
        for name in self.fields[1:]:
            self.events.add_scalar(name, log[-1][name], int(log[-1][self.fields[0]]))
        self.events.flush()
