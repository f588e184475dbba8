"""One interface to all methods of alignment."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from elocute.alignment.aligner import Aligner, dtw_aligner, soft_dtw_aligner
from elocute.alignment.alignment import Alignment, Views, check_views
from elocute.alignment.ctw import fit_ctw
from elocute.alignment.settings import (
    AlignConfig,
    CcaSoftConfig,
    CtwConfig,
    DcawConfig,
    DctwConfig,
    DtwConfig,
    SoftDtwConfig,
)
from elocute.array_types import Float32Array
from elocute.errors import AlignmentError, needs_extra

Progress = Callable[[float], None] | None
"""Called with the share of a fitting that is done, by methods that take long."""
Fit = Callable[[Sequence[Views], Any, int, Progress], Aligner]
DEFAULT = "softdtw"
"""Of two recordings alone: as fast as DTW, and a little better (docs/measurements/alignment.md)."""


@dataclass(frozen=True)
class Method:
    """How a method is fitted to groups of views, and its settings.

    any_width: views may differ in their number of features.
    """

    config: type[AlignConfig]
    fit: Fit
    any_width: bool


def _deep(module: str, name: str) -> Any:
    with needs_extra("deep alignment", "train,wild"):
        return getattr(importlib.import_module(f"elocute.alignment.{module}"), name)


METHODS: dict[str, Method] = {
    "dtw": Method(DtwConfig, lambda _g, config, _s, _d: dtw_aligner(config), False),
    "softdtw": Method(SoftDtwConfig, lambda _g, config, _s, _d: soft_dtw_aligner(config), False),
    "ctw": Method(CtwConfig, lambda groups, config, _s, _d: fit_ctw(groups, config), True),
    "dctw": Method(
        DctwConfig,
        lambda groups, config, seed, done: _deep("deep_fitting", "fit_dctw")(
            groups, config, seed, done
        ),
        True,
    ),
    "cca-soft": Method(
        CcaSoftConfig,
        lambda groups, config, seed, done: _deep("cca_soft", "fit_cca_soft")(
            groups, config, seed, done
        ),
        True,
    ),
    "dcaw": Method(
        DcawConfig,
        lambda groups, config, seed, done: _deep("dcaw", "fit_dcaw")(groups, config, seed, done),
        True,
    ),
}


def resolve_method(name: str) -> Method:
    """The method of that name. Raises AlignmentError for an unknown one."""
    if name not in METHODS:
        raise AlignmentError.about("method", found=f"{name!r}", allowed=", ".join(METHODS))
    return METHODS[name]


def fit_aligner(
    pairs: Sequence[Sequence[Float32Array]],
    method: str = "dcaw",
    config: AlignConfig | None = None,
    seed: int = 0,
    done: Progress = None,
) -> Aligner:
    """Fit a method of alignment to many pairs, or larger groups, of sequences.

    Whatever is learned is learned over all of them without ground truth: a word's network from
    many recordings of it.

    Parameters
    ----------
    pairs
        Groups of (frame, feature) arrays: (source, target) or more views, equally many in each
        group; view k has the same number of features in all groups.
    method
        One of `METHODS`: dtw, softdtw, ctw, dctw, cca-soft, dcaw.
    config
        Settings of that method; its defaults where None.
    seed
        Of everything random. Equal seeds give equal bits on one thread.
    done
        Called with the share of the fitting that is done, by methods that take long.

    Returns
    -------
    Aligner
        Fitted; `align` gives the alignment of views such as these.

    Raises
    ------
    AlignmentError
        For an unknown method, settings of another method, or sequences that cannot be aligned.
    MachineError
        For a deep method where torch is not installed.

    References
    ----------
    DTW: Sakoe & Chiba 1978. Soft-DTW: Cuturi & Blondel 2017. CTW: Zhou & de la Torre 2009. DCTW:
    Trigeorgis et al. 2016. DCAW: Tzirakis et al. 2019, section 4.1, with the differences that
    `elocute.alignment.dcaw` names.
    """
    chosen = resolve_method(method)
    config = chosen.config() if config is None else config
    if not isinstance(config, chosen.config):
        raise AlignmentError.about(
            "config", found=type(config).__name__, allowed=chosen.config.__name__
        )
    if not pairs:
        raise AlignmentError.about("pairs", found="none", allowed="one at least")
    groups = [
        check_views(pair, not chosen.any_width, f"pairs[{place}]")
        for place, pair in enumerate(pairs)
    ]
    kinds = {tuple(view.shape[1] for view in group) for group in groups}
    if len(kinds) > 1:
        raise AlignmentError.about(
            "pairs", found=f"feature counts {sorted(kinds)}", allowed="one count for each view"
        )
    return chosen.fit(groups, config, seed, done)


def align(
    views: Sequence[Float32Array],
    method: str = DEFAULT,
    config: AlignConfig | None = None,
    seed: int = 0,
    done: Progress = None,
) -> Alignment:
    """Align two or more sequences by a method fitted to them alone.

    Parameters
    ----------
    views
        Arrays (frame, feature); all with the same number of features for dtw and softdtw.
    method, config, seed, done
        As for `fit_aligner`.

    Returns
    -------
    Alignment
        The path, a score from 0 to 1, the compared features, and attention where there is one.

    Raises
    ------
    AlignmentError, MachineError
        As for `fit_aligner`.
    """
    return fit_aligner([views], method, config, seed, done).align(*views)
