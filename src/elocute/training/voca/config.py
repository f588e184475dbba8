"""Settings of a training; the defaults are the paper's."""

from __future__ import annotations

from dataclasses import dataclass

from elocute.errors import ModelError
from elocute.settings import SEED_MAX, check_settings, described, setting


@described
@dataclass(frozen=True)
class VocaTrainConfig:
    """VOCA 2019, section 5 ("Training parameters") unless said otherwise.

    A decoder into the span of the motion (`reduced`) has the same loss as one that decodes vertex
    by vertex, and is many times faster (docs/decisions/004-reduced-decoder.md).

    Raises
    ------
    ModelError
        For a number outside its range.
    """

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
    encoder: str = setting(
        "phones",
        help="Speech encoder: phones, fbank, deepspeech:FILE.pb, wav2vec2:FOLDER and the like.",
    )

    def __post_init__(self) -> None:
        check_settings(self, ModelError)
