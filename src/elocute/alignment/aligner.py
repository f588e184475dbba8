"""A fitted method of alignment: features of each view, costs of pairs of frames, one path.

A method is put together from three functions, so that methods share whatever they have in common:

    features    a view and its place among the views to what is compared
    pair_cost   the features of two views to a matrix of costs
    find_path   such a matrix to a monotone path, with attention where there is one
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import permutations

import numpy as np

from elocute.alignment.alignment import (
    Alignment,
    Views,
    WarpingPath,
    check_views,
)
from elocute.alignment.cca import LinearProjection, overall_correlation
from elocute.alignment.dtw import (
    CostMatrix,
    attention_path,
    dtw,
    expected_path,
    merge_paths,
    soft_dtw,
    soft_path,
    squared_distances,
)
from elocute.alignment.settings import AlignConfig, DtwConfig, DtwPathConfig, SoftDtwConfig
from elocute.array_types import Float32Array
from elocute.errors import AlignmentError
from elocute.one_line_repr import one_line


@dataclass(frozen=True, eq=False)
class ViewFeatures:
    """What a method makes of a view (frame, feature).

    compared: (frame, dimension), what costs and score are computed from. hidden: (frame, unit),
    what attention looks at; None for a method without attention.
    """

    compared: Float32Array
    hidden: Float32Array | None = None

    __repr__ = one_line


@dataclass(frozen=True, eq=False)
class PairPath:
    """The path of two views, and what else was found on the way.

    posterior  (source, target) soft-DTW's expected alignment, columns divided by their sums
    attention  (source, target) the method's attention, columns over the source that sum to one
    """

    path: WarpingPath
    posterior: Float32Array | None = None
    attention: Float32Array | None = None

    __repr__ = one_line


FeatureMap = Callable[[Float32Array, int], ViewFeatures]
PairCost = Callable[[ViewFeatures, ViewFeatures], CostMatrix]
PairAttention = Callable[[ViewFeatures, ViewFeatures], Float32Array]
PathFinder = Callable[[CostMatrix], PairPath]
AllAttention = dict[tuple[int, int], Float32Array]
"""The attention of all pairs of views, by the places of source and target."""


def raw_features(view: Float32Array, _place: int) -> ViewFeatures:
    """Features as they are given: nothing is fitted."""
    return ViewFeatures(view)


def projected_features(
    projections: Sequence[LinearProjection], view: Float32Array, place: int
) -> ViewFeatures:
    """Each view by its own projection."""
    return ViewFeatures(projections[place](view))


def mean_squared_differences(source: ViewFeatures, target: ViewFeatures) -> CostMatrix:
    """(source frame, target frame) mean squared difference of the compared features."""
    return squared_distances(source.compared, target.compared) / source.compared.shape[1]


@dataclass(frozen=True, eq=False, kw_only=True)
class Aligner:
    """A method fitted to its data; aligning changes nothing in it.

    config: the settings it was fitted with. widths: how many features each view had that it was
    fitted to; None where views may have any number, all the same. attend: the attention of a
    method whose path is not read from it. all_pairs: of three or more views, each path is read
    from the attention of all pairs (`consistent_attention`), not of its own alone.
    """

    config: AlignConfig
    find_path: PathFinder
    features: FeatureMap = raw_features
    pair_cost: PairCost = mean_squared_differences
    widths: tuple[int, ...] | None = None
    attend: PairAttention | None = None
    all_pairs: bool = False

    __repr__ = one_line

    def align(self, source: Float32Array, target: Float32Array, *more: Float32Array) -> Alignment:
        """Align views of the kinds that the method was fitted to.

        Of three or more views, the one of middle length is the reference to which the others are
        aligned.

        Parameters
        ----------
        source, target, *more
            Sequences (frame, feature), finite.

        Raises
        ------
        AlignmentError
            For views that cannot be aligned, that have other numbers of features than those the
            method was fitted to, or more than two views with open ends.
        """
        views = check_views((source, target, *more), self.widths is None)
        self._check_widths(views)
        return self._aligned(tuple(self.features(view, place) for place, view in enumerate(views)))

    def align_all(self, groups: Sequence[Views]) -> list[Alignment]:
        """Align many groups of views; a view that several groups share is encoded once."""
        known: dict[tuple[int, int], ViewFeatures] = {}
        for group in groups:
            for place, view in enumerate(group):
                if (id(view), place) not in known:
                    known[id(view), place] = self.features(view, place)
        return [
            self._aligned(tuple(known[id(view), place] for place, view in enumerate(group)))
            for group in groups
        ]

    def _aligned(self, views: tuple[ViewFeatures, ...]) -> Alignment:
        if len(views) == 2:
            pair = self.find_path(self.pair_cost(*views))
            if self.attend is not None:
                pair = replace(pair, attention=self.attend(*views))
        elif self.config.open_source:
            raise AlignmentError.about("open ends", found=f"{len(views)} views", allowed="two")
        else:
            pair = PairPath(self._path_of_many(views))
        compared = tuple(view.compared for view in views)
        whole = not self.config.open_source
        score = path_score(compared, pair.path)
        return Alignment(compared, pair.path, score, pair.attention, whole, pair.posterior)

    def _path_of_many(self, views: tuple[ViewFeatures, ...]) -> WarpingPath:
        lengths = [len(view.compared) for view in views]
        middle = int(np.argsort(lengths, kind="stable")[len(lengths) // 2])
        others = [place for place in range(len(views)) if place != middle]
        if self.all_pairs:
            attention = self._attention_of_all(views)
            paths = [attention_path(consistent_attention(attention, k, middle)) for k in others]
        else:
            paths = [self.find_path(self.pair_cost(views[k], views[middle])).path for k in others]
        columns = merge_paths(paths, lengths[middle])
        return columns[:, np.argsort([*others, middle])]

    def _attention_of_all(self, views: tuple[ViewFeatures, ...]) -> AllAttention:
        by_pair: AllAttention = {}
        for i, j in permutations(range(len(views)), 2):
            attention = self.find_path(self.pair_cost(views[i], views[j])).attention
            assert attention is not None
            by_pair[i, j] = attention
        return by_pair

    def _check_widths(self, views: Views) -> None:
        widths = tuple(view.shape[1] for view in views)
        known = self.widths
        if known is not None and widths[: len(known)] != known[: len(widths)]:
            raise AlignmentError.about(
                "views", found=f"{widths} features", allowed=f"{known}, as fitted to"
            )


def consistent_attention(attention: AllAttention, source: int, target: int) -> Float32Array:
    """(source, target) attention that agrees with that of all other pairs of views.

    The mean of the attention of the two views (twice, as each of them sees itself), and of that
    through every third view: where the target looks at the third and the third at the source.
    Columns sum to one. This is the consistency transformation of alignments of many sequences
    (Do et al. 2005).
    """
    views = sorted({place for pair in attention for place in pair})
    through = [
        attention[source, third] @ attention[third, target]
        for third in views
        if third not in (source, target)
    ]
    total = 2 * attention[source, target] + np.sum(through, axis=0)
    return (total / len(views)).astype(np.float32)


def path_score(compared: Sequence[Float32Array], path: WarpingPath) -> float:
    """Mean correlation of the compared features along the path, over all pairs of views: 0 to 1.

    It is high where one view, warped, moves as the other does.
    """
    along = [view[path[:, place]] for place, view in enumerate(compared)]
    pairs = [overall_correlation(along[i], along[j]) for j in range(len(along)) for i in range(j)]
    return float(np.mean(pairs))


def dtw_aligner(config: DtwPathConfig) -> Aligner:
    """Dynamic time warping of features as they are."""
    return Aligner(config=config, find_path=partial(find_dtw_path, config))


def projected_aligner(
    config: DtwPathConfig, projections: Sequence[LinearProjection], widths: Sequence[int]
) -> Aligner:
    """Dynamic time warping of projected views."""
    return Aligner(
        config=config,
        find_path=partial(find_dtw_path, config),
        features=partial(projected_features, tuple(projections)),
        widths=tuple(widths),
    )


def soft_dtw_aligner(config: SoftDtwConfig) -> Aligner:
    """Soft-DTW of features as they are."""
    return Aligner(config=config, find_path=partial(find_soft_dtw_path, config))


def find_dtw_path(config: DtwPathConfig, cost: CostMatrix) -> PairPath:
    """The cheapest path or, with `softness`, the one along the alignment expected at it."""
    if config.softness is None:
        return PairPath(dtw(cost, config.band, config.open_source)[0])
    gamma = config.softness * max(float(cost.mean()), 1e-9)
    expected = soft_dtw(cost, gamma, config.open_source)[1]
    path = expected_path(expected, config.band, config.open_source)
    return PairPath(path, normalised_columns(expected))


def read_features(fitted: Aligner, softness: float | None = None) -> Aligner:
    """A fitted method's features, with paths by DTW through their distances.

    softness: as of `PathSettings`; None for the cheapest path. An attention that the method has is
    not used.
    """
    config = fitted.config
    reading = DtwConfig(band=config.band, open_source=config.open_source, softness=softness)
    return replace(
        fitted,
        find_path=partial(find_dtw_path, reading),
        pair_cost=mean_squared_differences,
        all_pairs=False,
    )


def find_soft_dtw_path(config: SoftDtwConfig, cost: CostMatrix) -> PairPath:
    """The path that follows soft-DTW's expected alignment."""
    gamma = config.gamma * max(float(cost.mean()), 1e-9)
    expected = soft_dtw(cost, gamma, config.open_source)[1]
    path = soft_path(expected, config.band, config.open_source)
    return PairPath(path, normalised_columns(expected))


def normalised_columns(weights: CostMatrix) -> Float32Array:
    """(source, target) with columns over the source that sum to one."""
    return (weights / np.maximum(weights.sum(axis=0), 1e-30)).astype(np.float32)
