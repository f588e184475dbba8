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
        help="Largest distance of the path from the diagonal: frames (1 or more) or a share "
        "(below 1).",
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
    """What the deep methods train; part of their settings.

    Adam's learning rate is ten times that of the paper and more, as a word has few steps to learn
    in; its betas are the paper's (section 6.1).
    """

    dimensions: int = setting(10, low=1, help="Number of canonical dimensions that are compared.")
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

    dimensions: int = setting(10, low=1, help="Number of canonical dimensions that are compared.")
    energy: float = setting(
        0.95, above=0, high=1, help="Share of the variance that is kept before CCA."
    )
    ridge: float = setting(0.05, above=0, help="Regularisation of the covariances.")
    rounds: int = setting(10, low=1, help="Largest number of iterations of paths and projections.")
    shared: bool | None = setting(
        None, help="One projection for all views; none: where their feature counts are equal."
    )


@described
@dataclass(frozen=True, kw_only=True)
class DctwConfig(NetworkSettings, PathSettings, AlignConfig):
    """Settings of deep canonical time warping.

    With the learning rate of `cca-soft` it overfits to single pairs: the default is the best of
    those tried on the validation words.
    """

    rounds: int = setting(
        4, low=1, help="Iterations of network and paths; `steps` are divided among them."
    )
    learning_rate: float = setting(1e-3, above=0, help="Learning rate of Adam.")


@described
@dataclass(frozen=True, kw_only=True)
class CcaSoftConfig(NetworkSettings, PathSettings, AlignConfig):
    """Settings of correlated features read by soft-DTW.

    What this project called `dcaw` before it had that method.
    """

    prior: float = setting(
        20.0,
        low=0,
        help="Preference of the score for the diagonal, near which two readings of a word stay.",
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


ATTENTIONS = ("learned", "fixed", "sampled", "path", "diagonal", "uniform")


@described
@dataclass(frozen=True, kw_only=True)
class DcawConfig(NetworkSettings, AlignConfig):
    """Settings of deep canonical attentional warping.

    Chosen on words and voices that no reported number comes from (docs/measurements/alignment.md).
    Values of `attention` other than the first are there to measure what the attention is worth.
    """

    dimensions: int = setting(14, low=1, help="Number of canonical dimensions that are compared.")
    energy: float = setting(
        0.98, above=0, high=1, help="Share of the variance in the principal components to begin at."
    )
    windows: bool = setting(
        False, help="Views are windows of 41 x 128 x 3, seen by the paper's network (section 5)."
    )
    steps: int = setting(100, low=0, help="Steps of gradient ascent.")
    pairs: int = setting(48, low=1, help="Ordered pairs of views that a step learns from.")
    learning_rate: float = setting(2e-3, above=0, help="Learning rate of Adam.")
    attention_rate: float = setting(
        0.1, low=0, help="Learning rate of the attention, as a share of the encoders'."
    )
    folds: int = setting(
        4, low=0, help="Whitenings of the outputs to canonical variates before the first step."
    )
    fold_every: int = setting(25, low=1, help="Steps between two whitenings of the outputs.")
    mutual: bool = setting(
        True,
        help="Attend in both directions; off uses Eq. 2 alone.",
    )
    attention: str = setting(
        "learned",
        choices=ATTENTIONS,
        help="Warp of the views in training: the attention, learned or as it begins; its "
        "form by sampled sigmoids; DTW's path through the features; or none that looks at them.",
    )


DeepConfig = DctwConfig | CcaSoftConfig
"""Settings of the methods whose network starts from CTW."""
DtwPathConfig = DtwConfig | CtwConfig | DctwConfig | CcaSoftConfig
"""Settings of the methods whose path is DTW's, so that it can be read softly."""
