"""Settings of a training of VOCA, and presets of them."""

from __future__ import annotations

from dataclasses import dataclass

from elocute.settings import SEED_MAX, described, setting
from elocute.training.settings import TrainingSettings

PRESETS: dict[str, dict[str, object]] = {
    "default": {},
    "paper": {"reduced": False, "initialisers": "released"},
}
"""Settings that differ from the defaults. `paper` is Cudeiro et al. 2019 to the letter, given its
encoder: `deepspeech:FILE` with the graph that the authors used, which nobody may pass on."""


@described
@dataclass(frozen=True)
class VocaTrainConfig(TrainingSettings):
    """Settings of a training of VOCA, by default those of the paper's section 5 but for three.

    The encoder is the one that ships, not DeepSpeech. The decoder is `reduced` to the span of the
    motion: the same loss as vertex by vertex, and many times faster
    (docs/decisions/004-reduced-decoder.md). The paper is silent on how layers are initialised;
    `initialisers` are Xavier's, or those of the released code. `preset("paper")` sets both as
    published.

    Raises
    ------
    ModelError
        For a number outside its range.
    """

    presets = PRESETS

    epochs: int = setting(50, low=1, high=100_000, help="Passes over the training part.")
    batch_pairs: int = setting(
        64, low=1, high=65_536, help="Pairs of neighbouring frames in a batch."
    )
    learning_rate: float = setting(1e-4, low=1e-8, high=1.0, help="Learning rate of Adam.")
    position_weight: float = setting(
        1.0, low=0.0, high=1e6, help="Weight of the squared distance of vertices."
    )
    velocity_weight: float = setting(
        10.0,
        low=0.0,
        high=1e6,
        help="Weight of the squared distance of the vertices' steps from frame to frame.",
    )
    components: int = setting(
        50,
        low=1,
        high=4096,
        help="Size of the embedding; as many principal components initialise the decoder.",
    )
    seed: int = setting(0, low=0, high=SEED_MAX, help="Seed of all random numbers.")
    reduced: bool = setting(
        True, help="Decode into the span of the motion; vertex by vertex is far slower."
    )
    initialisers: str = setting(
        "xavier",
        choices=("xavier", "released"),
        help="Initial weights of all layers but the decoder: Xavier's uniform, or the released "
        "code's normal distributions cut at two standard deviations, 0.02 for convolutions and "
        "0.1 for the rest.",
    )
    encoder: str = setting(
        "phones",
        help="Speech encoder: phones, trunk, fbank, deepspeech:FILE.pb, wav2vec2:FOLDER and so on.",
    )
