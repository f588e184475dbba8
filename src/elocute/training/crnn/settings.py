"""Settings of a training of the recurrent model, and presets of them."""

from __future__ import annotations

from dataclasses import dataclass

from elocute.models.crnn_encoders import ENCODERS, MEL
from elocute.settings import SEED_MAX, described, setting
from elocute.training.settings import TrainingSettings

LOSSES = ("concordance", "mse")
BETAS = (0.9, 0.99)
PRESETS: dict[str, dict[str, object]] = {
    "default": {},
    "paper": {
        "weight_power": 1.0,
        "augment": 0.0,
        "highest_hz": 22050.0,
        "gradient_limit": 0.0,
        "captured": False,
    },
}
"""Settings that differ from the defaults. `paper` is Tzirakis et al. 2019, sections 5 and 6."""


@described
@dataclass(frozen=True)
class CrnnTrainConfig(TrainingSettings):
    """Settings of a training of the recurrent model; `preset("paper")` sets them as published.

    The defaults differ from the paper (In the wild 2019, sections 5 and 6) in five. Parameters
    weigh by the fourth root of their shares of the variance, not by the shares (`weight_power`);
    sounds are degraded (`augment`); bands above 8 kHz are muted (`highest_hz`); long gradients are
    cut (`gradient_limit`); captured clips are trained on too, not propagated ones alone
    (`captured`).

    The paper does not say for how many epochs it trains. Its learning rate is constant
    (`last_rate` 1; otherwise it falls by half a cosine).

    Raises
    ------
    ModelError
        For a number outside its range.
    """

    presets = PRESETS

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
        0.25,
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
        0.9,
        low=0.0,
        high=1.0,
        help="Share of clips augmented in training: noise, loudness, room, voice, tempo.",
    )
    highest_hz: float = setting(
        8000.0,
        unit="Hz",
        low=1000.0,
        high=22050.0,
        help="Highest frequency that the model uses; recordings at 16 kHz have none above 8000.",
    )
    gradient_limit: float = setting(
        5.0, low=0.0, high=1e6, help="Length to which longer gradients are cut; 0 for no limit."
    )
    captured: bool = setting(
        True, help="Whether captured clips are trained on, beside those that were carried over."
    )
    frames_most: int = setting(
        300, low=15, high=100_000, help="Most frames of a clip in training; longer ones are cut."
    )
    fps: float = setting(
        30.0, unit="frames/s", low=1.0, high=100.0, help="Frame rate of the model."
    )
    encoder: str = setting(
        MEL, choices=ENCODERS, help="What it hears: the paper's mel bands, or the trunk."
    )
    seed: int = setting(0, low=0, high=SEED_MAX, help="Seed of all random numbers.")
