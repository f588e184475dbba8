"""Settings of every method of alignment; needs neither torch nor numba."""

from __future__ import annotations

from dataclasses import dataclass

from elocute.errors import AlignmentError
from elocute.settings import check_settings, described, setting


@described
@dataclass(frozen=True, kw_only=True)
class AlignConfig:
    """Settings of every method.

    Raises
    ------
    AlignmentError
        For a number outside its range.
    """

    band: float | None = setting(
        None,
        above=0,
        help="How far from the diagonal a path may go: frames (1 or more) or a share (below 1).",
    )
    open_source: bool = setting(
        False,
        help="Find the target within the source: the ends of the path are free in the source.",
    )

    def __post_init__(self) -> None:
        check_settings(self, AlignmentError)
        if self.band is not None and self.open_source:
            raise AlignmentError.about("`band`", found="open ends", allowed="one of the two")


@dataclass(frozen=True, kw_only=True)
class PathSettings:
    """How methods that end in DTW read their path; part of their settings."""

    softness: float | None = setting(
        None,
        above=0,
        help="Softness of the alignment along which the path is read, as a share of the mean cost "
        "of a pair of frames; none: the cheapest path.",
    )


@dataclass(frozen=True, kw_only=True)
class NetworkSettings:
    """What both deep methods train; part of their settings.

    Adam's learning rate is ten times that of the paper, as a word has few steps to learn in; its
    betas are the paper's (section 6.1).
    """

    dimensions: int = setting(10, low=1, help="How many canonical dimensions are compared.")
    filters: int = setting(32, low=1, help="Filters of the convolutions.")
    units: int = setting(16, low=1, help="Units of the recurrent layers.")
    steps: int = setting(40, low=0, help="Steps of gradient descent.")
    pairs: int = setting(16, low=1, help="Pairs of the groups that are drawn for each step.")
    learning_rate: float = setting(5e-3, above=0, help="Learning rate of Adam.")
    weight_decay: float = setting(1e-3, low=0, help="Weight decay of Adam.")
    ridge: float = setting(0.05, above=0, help="Regularisation of the covariances.")
    shared: bool | None = setting(
        None, help="One network for all views; none: where their feature counts are equal."
    )


@described
@dataclass(frozen=True, kw_only=True)
class DtwConfig(PathSettings, AlignConfig):
    """Settings of DTW."""


@described
@dataclass(frozen=True, kw_only=True)
class SoftDtwConfig(AlignConfig):
    """Settings of soft-DTW."""

    gamma: float = setting(
        0.05, above=0, help="Softness, as a share of the mean cost of a pair of frames."
    )


@described
@dataclass(frozen=True, kw_only=True)
class CtwConfig(PathSettings, AlignConfig):
    """Settings of canonical time warping."""

    dimensions: int = setting(10, low=1, help="How many canonical dimensions are compared.")
    energy: float = setting(
        0.95, above=0, high=1, help="Share of the variance that is kept before CCA."
    )
    ridge: float = setting(0.05, above=0, help="Regularisation of the covariances.")
    rounds: int = setting(10, low=1, help="Most iterations of paths and projections.")
    shared: bool | None = setting(
        None, help="One projection for all views; none: where their feature counts are equal."
    )


@described
@dataclass(frozen=True, kw_only=True)
class DctwConfig(NetworkSettings, PathSettings, AlignConfig):
    """Settings of deep canonical time warping.

    With DCAW's learning rate it overfits to single pairs: the default is the best of those tried on
    the validation words.
    """

    rounds: int = setting(
        4, low=1, help="Iterations of network and paths; `steps` are divided among them."
    )
    learning_rate: float = setting(1e-3, above=0, help="Learning rate of Adam.")


@described
@dataclass(frozen=True, kw_only=True)
class DcawConfig(NetworkSettings, PathSettings, AlignConfig):
    """Settings of deep canonical attentional warping."""

    prior: float = setting(
        20.0,
        low=0,
        help="How strongly the score favours the diagonal, near which two readings of a word stay.",
    )
    guide: float = setting(
        1.0,
        low=0,
        help="Weight of following CTW's paths while training, which falls to zero halfway.",
    )
    sharpness: float = setting(
        0.3,
        low=0,
        help="Weight of -log attention beside the distance of features, at use.",
    )
    softness: float | None = setting(
        0.1, above=0, help="Softness of the monotone reading of both; none: the cheapest path."
    )


DeepConfig = DctwConfig | DcawConfig
DtwPathConfig = DtwConfig | CtwConfig | DctwConfig | DcawConfig
"""Settings of the methods whose path is DTW's, so that it can be read softly."""
