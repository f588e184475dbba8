"""What every fitted method is: features of each view, costs of pairs, one path."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from elocute.alignment.alignment import Alignment, Array, Group, Path, checked_group
from elocute.alignment.cca import correlation
from elocute.alignment.config import AlignConfig, PlainConfig, SoftConfig
from elocute.alignment.dtw import Matrix, dtw, squared_distances
from elocute.alignment.soft_dtw import soft_dtw, soft_path
from elocute.alignment.warping_paths import expected_path, merged
from elocute.errors import AlignmentError
from elocute.one_line_repr import one_line


@dataclass(frozen=True, eq=False)
class Embedded:
    """What a method makes of a view: features that are compared, and what attention looks at."""

    features: Array
    hidden: Array | None = None

    __repr__ = one_line


@dataclass(frozen=True, eq=False)
class Match:
    """A pair of views: the path, and the attention where the method has one."""

    path: Path
    attention: Array | None = None

    __repr__ = one_line


class Aligner(ABC):
    """A method fitted to its data; `align` changes nothing in it."""

    config: AlignConfig
    widths: tuple[int, ...] | None = None
    """Features of each view that it was fitted to; None for any, all alike."""

    def embed(self, view: Array, side: int) -> Embedded:
        """side says which view it is. As given, by default."""
        return Embedded(view)

    @abstractmethod
    def match(self, source: Embedded, target: Embedded, sides: tuple[int, int]) -> Match:
        """The path of two views."""

    def cost(self, source: Array, target: Array) -> Matrix:
        """(source frame, target frame) mean squared difference of embedded views."""
        return squared_distances(source, target) / source.shape[1]

    def align(self, source: Array, target: Array, *more: Array) -> Alignment:
        """Align views of the kinds it was fitted to. Raises AlignmentError.

        Of three or more, the one of middle length is the reference to which each is aligned.
        """
        views = checked_group((source, target, *more), self.widths is None)
        self._check_widths(views)
        return self._aligned(tuple(self.embed(view, side) for side, view in enumerate(views)))

    def align_all(self, groups: Sequence[Group]) -> list[Alignment]:
        """The same of many groups that share views: each view is embedded once."""
        known: dict[tuple[int, int], Embedded] = {}
        for group in groups:
            for side, view in enumerate(group):
                if (id(view), side) not in known:
                    known[id(view), side] = self.embed(view, side)
        return [
            self._aligned(tuple(known[id(view), side] for side, view in enumerate(group)))
            for group in groups
        ]

    def _aligned(self, known: tuple[Embedded, ...]) -> Alignment:
        features = tuple(each.features for each in known)
        if len(known) == 2:
            match = self.match(known[0], known[1], (0, 1))
            return self._alignment(features, match.path, match.attention)
        if self.config.open_source:
            raise AlignmentError.about("open ends", found=f"{len(known)} views", allowed="two")
        path = self._many(known)
        return self._alignment(features, path, None)

    def _many(self, views: tuple[Embedded, ...]) -> Path:
        lengths = [len(view.features) for view in views]
        middle = int(np.argsort(lengths, kind="stable")[len(lengths) // 2])
        others = [side for side in range(len(views)) if side != middle]
        paths = [self.match(views[s], views[middle], (s, middle)).path for s in others]
        columns = merged(paths, lengths[middle])
        return columns[:, np.argsort([*others, middle])]

    def _alignment(self, features: Group, path: Path, attention: Array | None) -> Alignment:
        whole = not self.config.open_source
        return Alignment(features, path, score(features, path), attention, whole)

    def _check_widths(self, views: Group) -> None:
        found = tuple(view.shape[1] for view in views)
        known = self.widths
        if known is not None and found[: len(known)] != known[: len(found)]:
            raise AlignmentError.about(
                "views", found=f"{found} features", allowed=f"{known}, as fitted to"
            )


def score(features: Sequence[Array], path: Path) -> float:
    """Mean correlation of the compared features along the path, over all pairs of views: 0 to 1.

    High where one view, warped, moves as the other does.
    """
    along = [view[path[:, side]] for side, view in enumerate(features)]
    pairs = [correlation(along[i], along[j]) for j in range(len(along)) for i in range(j)]
    return float(np.mean(pairs))


class DtwAligner(Aligner):
    """Nothing is fitted: features as they are."""

    config: PlainConfig

    def __init__(self, config: PlainConfig) -> None:
        self.config = config

    def match(self, source: Embedded, target: Embedded, sides: tuple[int, int]) -> Match:
        return self.read(self.cost(source.features, target.features))

    def read(self, cost: Matrix) -> Match:
        """The path through costs (source frame, target frame), as the settings say."""
        settings = self.config
        if settings.softness is None:
            return Match(dtw(cost, settings.band, settings.open_source)[0])
        gamma = settings.softness * max(float(cost.mean()), 1e-9)
        expected = soft_dtw(cost, gamma, settings.open_source)[1]
        path = expected_path(expected, settings.band, settings.open_source)
        return Match(path, attention_of(expected))


def attention_of(expected: Matrix) -> Array:
    """(source, target) expected alignment with columns over the source that sum to one."""
    return (expected / np.maximum(expected.sum(axis=0), 1e-30)).astype(np.float32)


class SoftDtwAligner(Aligner):
    """Soft-DTW: the path that follows the expected alignment."""

    config: SoftConfig

    def __init__(self, config: SoftConfig) -> None:
        self.config = config

    def match(self, source: Embedded, target: Embedded, sides: tuple[int, int]) -> Match:
        cost, settings = self.cost(source.features, target.features), self.config
        gamma = settings.gamma * max(float(cost.mean()), 1e-9)
        _, expected = soft_dtw(cost, gamma, settings.open_source)
        path = soft_path(expected, settings.band, settings.open_source)
        return Match(path, attention_of(expected))
