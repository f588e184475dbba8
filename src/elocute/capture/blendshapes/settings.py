"""Settings of a learned basis."""

from __future__ import annotations

from dataclasses import dataclass

from elocute.errors import InputError
from elocute.settings import check_settings, described, setting

COMPONENTS = 28  # in the wild 2019, section 3.3: 99.9 % of the variance of its four speakers
COMPONENTS_MAX = 400


@described
@dataclass(frozen=True)
class BlendshapeConfig:
    """How a basis is learned; the default is the paper's.

    Raises
    ------
    InputError
        For a number outside its range.
    """

    components: int | None = setting(
        None,
        low=1,
        high=COMPONENTS_MAX,
        help=f"Number of shapes; {COMPONENTS} unless `variance` is given.",
    )
    variance: float | None = setting(
        None,
        low=0.01,
        high=1.0,
        help="Learn as many shapes as explain this share of the squared displacement.",
    )
    sparsity: float = setting(
        0.0,
        low=0.0,
        high=0.9,
        help="Locality of the shapes: 0 for principal components, more for smaller parts.",
    )

    def __post_init__(self) -> None:
        check_settings(self)
        if self.components is not None and self.variance is not None:
            raise InputError.about("`components`", found="`variance` too", allowed="one of them")

    @property
    def count(self) -> int | None:
        """How many shapes; None for as many as `variance` needs."""
        return COMPONENTS if self.components is None and self.variance is None else self.components
