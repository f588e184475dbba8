"""Settings of a training; the defaults are the paper's."""

from __future__ import annotations

from dataclasses import asdict, dataclass

from elocute.training.ranges import check_ranges

RANGES: dict[str, tuple[float, float]] = {
    "epochs": (1, 100_000),
    "batch_pairs": (1, 65_536),
    "learning_rate": (1e-8, 1.0),
    "position_weight": (0.0, 1e6),
    "velocity_weight": (0.0, 1e6),
    "components": (1, 4096),
    "seed": (0, 2**31 - 1),
}


@dataclass(frozen=True)
class TrainConfig:
    """VOCA 2019, section 5 ("Training parameters") unless said otherwise.

    batch_pairs      pairs of neighbouring frames in a batch
    position_weight  of the squared distance of vertices
    velocity_weight  of the squared distance of their steps from frame to frame
    components       size of the embedding, which principal components initialise the decoder of
    reduced          decode into the span of the motion instead of vertex by vertex: the same
                     loss, many times faster (docs/decisions/004-reduced-decoder.md)

    Raises ModelError for a number outside its range.
    """

    epochs: int = 50
    batch_pairs: int = 64
    learning_rate: float = 1e-4
    position_weight: float = 1.0
    velocity_weight: float = 10.0
    components: int = 50
    seed: int = 0
    reduced: bool = True
    encoder: str = "phones"

    def __post_init__(self) -> None:
        check_ranges(self, RANGES)

    def record(self) -> dict[str, object]:
        """For checkpoints."""
        return asdict(self)
