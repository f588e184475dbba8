"""One interface to all methods of alignment."""

from __future__ import annotations

import importlib
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from elocute.alignment.aligner import Aligner, DtwAligner, SoftDtwAligner
from elocute.alignment.alignment import Alignment, Array, Group, checked_group
from elocute.alignment.config import (
    AlignConfig,
    CtwConfig,
    DcawConfig,
    DctwConfig,
    PlainConfig,
    SoftConfig,
)
from elocute.alignment.ctw import fit_ctw
from elocute.errors import AlignmentError, needs_extra

Done = Callable[[float], None] | None
"""Told the share of a fitting that is done, by methods that take long."""
Fit = Callable[[Sequence[Group], Any, int, Done], Aligner]
DEFAULT = "softdtw"
"""Of two recordings alone: as fast as DTW, and a little better (docs/measurements/alignment.md)."""


@dataclass(frozen=True)
class Method:
    """How a method is fitted to groups of views, and its settings; `any_width` where views may
    differ in their feature counts."""

    config: type[AlignConfig]
    fit: Fit
    any_width: bool


def _deep(module: str, name: str) -> Any:
    with needs_extra("deep alignment", "train,wild"):
        return getattr(importlib.import_module(f"elocute.alignment.{module}"), name)


METHODS: dict[str, Method] = {
    "dtw": Method(PlainConfig, lambda _g, config, _s, _d: DtwAligner(config), False),
    "softdtw": Method(SoftConfig, lambda _g, config, _s, _d: SoftDtwAligner(config), False),
    "ctw": Method(CtwConfig, lambda groups, config, _s, _d: fit_ctw(groups, config), True),
    "dctw": Method(
        DctwConfig,
        lambda groups, config, seed, done: _deep("dctw", "fit_dctw")(groups, config, seed, done),
        True,
    ),
    "dcaw": Method(
        DcawConfig,
        lambda groups, config, seed, done: _deep("dcaw", "fit_dcaw")(groups, config, seed, done),
        True,
    ),
}


def resolve_method(name: str) -> Method:
    """The method of that name. Raises AlignmentError for one that there is not."""
    if name not in METHODS:
        raise AlignmentError.about("method", found=f"{name!r}", allowed=", ".join(METHODS))
    return METHODS[name]


def fit_aligner(
    pairs: Sequence[Sequence[Array]],
    method: str = "dcaw",
    config: AlignConfig | None = None,
    seed: int = 0,
    done: Done = None,
) -> Aligner:
    """Fit a method to pairs (source, target), or larger groups, of (frame, feature) arrays.

    What is learned, is learned over all of them without any truth: a word's network from many
    recordings of it. Groups are equally large, and view k has one feature count in all. Equal
    seeds give equal bits on one thread. `done` is told how far deep methods are. Raises
    AlignmentError, MachineError without torch.
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
        checked_group(pair, not chosen.any_width, f"pairs[{place}]")
        for place, pair in enumerate(pairs)
    ]
    kinds = {tuple(view.shape[1] for view in group) for group in groups}
    if len(kinds) > 1:
        raise AlignmentError.about(
            "pairs", found=f"feature counts {sorted(kinds)}", allowed="one count for each view"
        )
    return chosen.fit(groups, config, seed, done)


def align(
    views: Sequence[Array],
    method: str = DEFAULT,
    config: AlignConfig | None = None,
    seed: int = 0,
    done: Done = None,
) -> Alignment:
    """Align two or more sequences (frame, feature) by a method fitted to them alone."""
    return fit_aligner([views], method, config, seed, done).align(*views)
