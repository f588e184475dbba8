"""Settings of a training of the network of Karras et al. 2017, and presets of them."""

from __future__ import annotations

from dataclasses import dataclass

from elocute.settings import SEED_MAX, described, setting
from elocute.training.settings import TrainingSettings

PRESETS: dict[str, dict[str, object]] = {
    "default": {},
    "paper": {
        "epochs": 500,
        "batch_runs": 25,
        "run_frames": 2,
        "emotion_frames": 1,
        "emotion_speed": 1.0,
        "reduced": False,
    },
}
"""Settings that differ from the defaults. `paper` is Karras et al. 2017: pairs of frames from
anywhere, an emotion vector for every frame, every vertex an output."""


@described
@dataclass(frozen=True)
class KarrasTrainConfig(TrainingSettings):
    """Settings of a training of Karras et al. 2017, section 4.

    `preset("paper")` is the published training; it takes days on a processor. The defaults differ
    where that makes it affordable: batches are of runs of neighbouring frames, whose windows share
    most of their sound; the emotional state is interpolated between vectors a second apart, which
    learn ten times as fast as the weights, so that they settle within few epochs; and the decoder
    is `reduced` to the span of the motion, which leaves the loss as it is
    (docs/decisions/004-reduced-decoder.md, 011-karras.md).

    Raises
    ------
    ModelError
        For a number outside its range.
    """

    presets = PRESETS

    epochs: int = setting(30, low=1, high=100_000, help="Passes over the training part.")
    batch_runs: int = setting(4, low=1, high=65_536, help="Runs of frames in a batch.")
    run_frames: int = setting(
        16, low=2, high=1024, help="Neighbouring frames in a run, 32 ms apart; 2 as published."
    )
    learning_rate: float = setting(
        1e-3,
        low=1e-8,
        high=1.0,
        help="Learning rate of Adam at the end of the first epoch: it rises to there, and falls "
        "with the root of the epochs from there.",
    )
    emotion: int = setting(16, low=1, high=1024, help="Length of an emotion vector.")
    emotion_frames: int = setting(
        32,
        low=1,
        high=100_000,
        help="Frames between two learned emotion vectors, linear in between; 1 as published.",
    )
    emotion_speed: float = setting(
        10.0, low=0.01, high=1000.0, help="Learning rate of emotion vectors, relative to weights."
    )
    components: int = setting(
        150,
        low=1,
        high=4096,
        help="Size of the embedding; as many principal components initialise the decoder.",
    )
    noise: bool = setting(
        True, help="Multiply the inputs of convolutions by random factors in training."
    )
    seed: int = setting(0, low=0, high=SEED_MAX, help="Seed of all random numbers.")
    reduced: bool = setting(
        True, help="Decode into the span of the motion; vertex by vertex is far slower."
    )
