"""Settings of a training; the defaults are the paper's."""

from __future__ import annotations

from dataclasses import dataclass

from elocute.errors import ModelError
from elocute.settings import SEED_MAX, check_settings, described, setting

LOSSES = ("concordance", "mse")
BETAS = (0.9, 0.99)


@described
@dataclass(frozen=True)
class CrnnTrainConfig:
    """In the wild 2019, sections 5 and 6, unless said otherwise.

    The paper does not say how many epochs it trains. Its learning rate is constant (`last_rate` 1,
    else half a cosine), its loss is Eq. 10, its parameters weigh as their shares of the variance
    (`weight_power` 1), and it augments no clips (`augment` 0; see `augment.py`).

    Raises
    ------
    ModelError
        For a number outside its range.
    """

    epochs: int = setting(50, low=1, high=100_000, help="Passes over the training part.")
    batch_clips: int = setting(50, low=1, high=4096, help="Clips in a batch.")
    learning_rate: float = setting(
        5e-4, low=1e-8, high=1.0, help="Learning rate of Adam, whose decays are 0.9 and 0.99."
    )
    last_rate: float = setting(
        1.0, low=1e-4, high=1.0, help="Share of the learning rate left in the last epoch."
    )
    loss: str = setting("concordance", choices=LOSSES, help="Loss that is minimised.")
    weight_power: float = setting(
        1.0,
        low=0.0,
        high=1.0,
        help="Weight of a parameter: its share of the variance to this power; 0 weighs all alike.",
    )
    keep: float = setting(
        0.5,
        low=0.01,
        high=1.0,
        help="Share of a clip that is left when its ends are cut at random.",
    )
    augment: float = setting(
        0.0,
        low=0.0,
        high=1.0,
        help="Share of clips augmented in training: noise, loudness, room, voice, tempo.",
    )
    highest_hz: float = setting(
        22050.0,
        unit="Hz",
        low=1000.0,
        high=22050.0,
        help="Highest frequency that the model uses; 8000 for recordings at 16 kHz.",
    )
    frames_most: int = setting(
        300, low=15, high=100_000, help="Most frames of a clip in training; longer ones are cut."
    )
    fps: float = setting(
        30.0, unit="frames/s", low=1.0, high=100.0, help="Frame rate of the model."
    )
    seed: int = setting(0, low=0, high=SEED_MAX, help="Seed of all random numbers.")

    def __post_init__(self) -> None:
        check_settings(self, ModelError)
