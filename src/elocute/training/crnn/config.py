"""Settings of a training; the defaults are the paper's."""

from __future__ import annotations

from dataclasses import asdict, dataclass

from elocute.errors import ModelError
from elocute.training.ranges import check_ranges

RANGES: dict[str, tuple[float, float]] = {
    "epochs": (1, 100_000),
    "batch_clips": (1, 4096),
    "learning_rate": (1e-8, 1.0),
    "last_rate": (1e-4, 1.0),
    "weight_power": (0.0, 1.0),
    "keep": (0.01, 1.0),
    "augment": (0.0, 1.0),
    "highest_hz": (1000.0, 22050.0),
    "frames_most": (15, 100_000),
    "fps": (1.0, 100.0),
    "seed": (0, 2**31 - 1),
}
LOSSES = ("concordance", "mse")
BETAS = (0.9, 0.99)


@dataclass(frozen=True)
class CrnnTrainConfig:
    """In the wild 2019, sections 5 and 6, unless said otherwise.

    epochs        passes over the training part; the paper does not say how many
    batch_clips   clips in a batch
    learning_rate of Adam with decays 0.9 and 0.99
    last_rate     share of the learning rate that the last epoch has left, on half a cosine; 1 is
                  the paper's constant rate
    loss          concordance (Eq. 10), or mse for the comparison
    weight_power  parameters weigh as their shares of the variance to this power: 1 is the paper's,
                  0 lets all weigh the same
    keep          a clip is cut at both ends at random; this share of it is always kept
    augment       share of clips whose spectrum is made worse: noise, loudness, equalisation,
                  vocal tract, tempo (`augment.py`); 0 is the paper's
    highest_hz    bands above are not heard: 22050 hears all, 8000 what 16 kHz recordings hold
    frames_most   longer clips are cut to so many frames in training
    fps           frames per second of the model

    Raises ModelError for a number outside its range.
    """

    epochs: int = 50
    batch_clips: int = 50
    learning_rate: float = 5e-4
    last_rate: float = 1.0
    loss: str = "concordance"
    weight_power: float = 1.0
    keep: float = 0.5
    augment: float = 0.0
    highest_hz: float = 22050.0
    frames_most: int = 300
    fps: float = 30.0
    seed: int = 0

    def __post_init__(self) -> None:
        if self.loss not in LOSSES:
            raise ModelError.about("training loss", found=self.loss, allowed=", ".join(LOSSES))
        check_ranges(self, RANGES)

    def record(self) -> dict[str, object]:
        """For checkpoints."""
        return asdict(self)
