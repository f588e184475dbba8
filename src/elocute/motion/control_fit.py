"""Fits weights of any set of mouth shapes to a motion of the built-in head.

Each shape is described by weights of the head's own: a viseme is the look that the head has for it.
The weights are non-negative, few at a time, and as smooth as the motion: each frame is a strictly
convex problem, so that its solution changes no faster than what it is solved for, and a take that
is cut has the same weights. Whole mouths (visemes, vowels) share a weight of one, and where the
motion's lips seal, the one that seals them is taken in full, or none where there is no such.

Where the shapes' own mouth was measured, its gap, width and jaw become the motion's in its size;
weights that are given then change by as little as that takes.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cache, lru_cache

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array, Float64Array
from elocute.head.builtin import load_builtin_head
from elocute.head.model import HeadModel
from elocute.head.viseme_shapes import VISEME_SHAPES
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import measure_mouth
from elocute.motion.mouth_seam import SHARES, MeasuredMouth, find_mouth
from elocute.numerics.bounded_least_squares import solve_box_sum

MOUTH = ("jaw", "mouth", "tongue")
SIDEWAYS = frozenset(("jawLeft", "jawRight", "mouthLeft", "mouthRight"))
"""What only moves as far as the motion does."""
MOVED_M = 1e-4
"""What no shape of the mouth moves further than this is left out."""
LIPS, GAP, SHUT, MEASURED_SHUT = 4.0, 45.0, 2500.0, 700.0
"""How much more a vertex of the lips counts, the gap between them, and that of lips that touch."""
WIDTH, JAW = 12.0, 12.0
"""How much more than a vertex the width and the jaw of a measured mouth count."""
TOUCH_M = 1e-3
"""Lips this far apart count about a third of the way to those that touch."""
CLOSED_MM = 0.05
"""Lips that are this near touch."""
SEALED_MM, APART_MM = 0.3, 2.0
"""Lips pressed on each other are sealed up to the one, and not at all from the other on."""
WIDE_MM = 5.0
"""From this opening on, the shape that seals lips is no part of a mouth."""
PRESS = ("mouthPressLeft", "mouthPressRight")
ROLLED = 0.15
"""Of `mouthClose`: from here on lips that it closes over an open jaw are sealed."""
RIDGE = 1e-3  # of the mean squared length of a shape
SPARSE = 0.01  # of the same: what a weight costs, whatever the fit
LIKENESS, MEASURED_LIKENESS = 0.55, 0.3
"""What the look of the skin counts beside gap, width and jaw, and where these are measured."""
STIFF_M = 0.02
"""What a weight that is given costs where it changes by its freedom."""
FREEDOM = {"jawOpen": 1.0, "mouthClose": 1.0, "mouthPucker": 0.2} | {
    f"{name}{side}": far
    for name, far in (("mouthLowerDown", 0.3), ("mouthUpperUp", 0.2), ("mouthStretch", 0.2))
    for side in ("Left", "Right")
}
"""How freely weights that are given change for a measured mouth; others stay."""


@dataclass(frozen=True, eq=False)
class ControlFit:
    """Weights of mouth shapes, and how far they are from the motion.

    Attributes
    ----------
    weights : (frame, control) float32
        0 to 1.
    skin_mm : float
        Root mean square of what the skin around the mouth is off, over places that move and frames.
    opening_mm : float
        How far the opening of the lips is off, on average.
    closed_mm : float
        The widest opening where the motion's lips touch.
    """

    weights: Float32Array
    skin_mm: float
    opening_mm: float
    closed_mm: float

    def residual(self) -> dict[str, float]:
        """What the fit leaves, as files say it."""
        parts = (("skin", self.skin_mm), ("opening", self.opening_mm), ("closed", self.closed_mm))
        return {name: round(value, 3) for name, value in parts}


@cache
def builtin_mouth(names: tuple[str, ...]) -> MeasuredMouth:
    """The built-in head's mouth as shapes' own are measured; names: its curves, as the shapes."""
    head = load_builtin_head()
    basis = head.expression_basis.astype(np.float64)
    columns = [head.expression_index(name) for name in names]
    drop = -basis[head.expression_index("jawOpen"), :, 1]
    points, triangles = head.template.astype(np.float64), head.triangles.astype(np.intp)
    mouth = find_mouth(points, triangles, drop, lambda used: basis[columns][:, used])
    assert mouth is not None
    return mouth


def is_of_mouth(curve: str) -> bool:
    """Whether a curve of the built-in head moves its mouth."""
    return curve.startswith(MOUTH)


def is_whole_mouth(look: dict[str, float]) -> bool:
    """Whether a shape, as curves of the built-in head, is a whole mouth: a viseme or a vowel, which
    others share a weight with."""
    return 0 < look.get("jawOpen", 0.0) < 1


def fit_controls(
    motion: Motion,
    looks: Sequence[dict[str, float]],
    own: MeasuredMouth | None = None,
    given: Float32Array | None = None,
) -> ControlFit:
    """Fit weights of mouth shapes to a motion of a head with the built-in head's shapes.

    `looks` says of each shape which curves of the head it is at weight one; `own`, what the shapes
    do on their own mesh, where that is known. Weights `given` (frame, control) are corrected by a
    measured mouth; without them they are found.
    """
    head = motion.head
    names = tuple(name for name in head.expression_names if is_of_mouth(name))
    columns = [head.expression_index(name) for name in names]
    curves = motion.weights[:, columns].astype(np.float64)
    mixes = np.array([[look.get(name, 0.0) for name in names] for look in looks], np.float64)
    skin, counted, places = _skin(head, names)
    if given is None:
        likeness = LIKENESS if own is None else MEASURED_LIKENESS
        plain, sides, low, high = _alike(curves, mixes, looks, names, likeness * counted)
    else:
        plain, sides, low, high = _near(given, looks)
    opening_mm = measure_mouth(motion)["opening_mm"]
    seals = _seals(dict(zip(names, curves.T, strict=True)), opening_mm)
    sealed = [VISEME_SHAPES["PP"].get(name, 0.0) for name in names]
    sealing = np.flatnonzero(np.abs(mixes - sealed).max(axis=1, initial=0) < 1e-6)[:1]
    shutting = np.clip((WIDE_MM - opening_mm) / (WIDE_MM - APART_MM), 0, 1)
    high[:, sealing] = np.minimum(high[:, sealing], np.maximum(shutting, seals)[:, None])
    low[:, sealing] = seals[:, None]
    most = np.ones(len(curves)) if len(sealing) else 1 - seals
    effects, wanted, more, rest = _on_own_mesh(own, mixes, curves, names, seals, sealing, given)
    touching = np.exp(-((np.maximum(wanted, 0).mean(axis=1) / TOUCH_M) ** 2))
    shut = SHUT if own is None else MEASURED_SHUT
    shares = (GAP**2 + (shut**2 - GAP**2) * touching) / len(SHARES)
    plain, sides = plain + more @ more.T, sides + rest @ more.T
    sides += shares[:, None] * (wanted @ effects.T)
    close = effects @ effects.T
    mouths = np.array([is_whole_mouth(look) for look in looks], np.float64)
    weights, last, free = low.copy(), None, (low < high).any(axis=0)
    held = low[:, ~free] @ np.concatenate([plain, close], axis=1)[~free]
    sides -= held[:, : len(looks)] + shares[:, None] * held[:, len(looks) :]
    plain, close, sides = plain[free][:, free], close[free][:, free], sides[:, free]
    for frame, (share, side, whole) in enumerate(zip(shares, sides, most, strict=True)):
        bounds = low[frame, free], high[frame, free]
        last = solve_box_sum(plain + share * close, side, *bounds, mouths[free], whole, last)
        weights[frame, free] = last
    off = weights @ mixes - curves
    squares = np.einsum("fc,cd,fd->f", off, skin, off) / places
    had, open_mm = (1000 * each.mean(axis=1) for each in (weights @ effects, wanted))
    return ControlFit(
        weights.astype(np.float32),
        1000 * float(np.sqrt(max(0.0, squares.mean()))),
        float(np.abs(had - open_mm).mean()),
        float(had[open_mm < CLOSED_MM].max(initial=0.0)),
    )


_Wish = tuple[Float64Array, Float64Array, Float64Array, Float64Array]
"""(control, control) and (frame, control) of the squares that are least, and the least and the most
of weights (frame, control)."""


def _alike(
    curves: Float64Array,
    mixes: Float64Array,
    looks: Sequence[dict[str, float]],
    names: tuple[str, ...],
    skin: Float64Array,
) -> _Wish:
    """Weights with which the skin (curve, curve) looks as it does in the motion."""
    plain = mixes @ skin @ mixes.T
    mean = float(np.trace(plain)) / max(1, len(plain))
    plain[np.diag_indices_from(plain)] += RIDGE * mean
    sides = curves @ skin @ mixes.T - SPARSE * mean
    low, high = np.zeros_like(sides), np.ones_like(sides)
    for place, look in enumerate(looks):
        if look and SIDEWAYS.issuperset(look):  # two that pull against each other are no mouth
            high[:, place] = min(1.0, curves[:, [names.index(name) for name in look]].max())
    return plain, sides, low, high


def _near(wished: Float32Array, looks: Sequence[dict[str, float]]) -> _Wish:
    """Weights near those that are given; what has no freedom stays."""
    freedom = [max((FREEDOM.get(name, 0.0) for name in look), default=0.0) for look in looks]
    costs = (STIFF_M / np.maximum(freedom, 1e-3)) ** 2
    low, high = np.zeros(wished.shape), np.maximum(wished, 1).astype(np.float64)
    fixed = np.equal(freedom, 0)
    low[:, fixed] = high[:, fixed] = wished[:, fixed]
    return np.diag(costs), wished * costs, low, high


def _on_own_mesh(
    own: MeasuredMouth | None,
    mixes: Float64Array,
    curves: Float64Array,
    names: tuple[str, ...],
    seals: Float64Array,
    sealing: NDArray[np.intp],
    given: Float32Array | None,
) -> tuple[Float64Array, Float64Array, Float64Array, Float64Array]:
    """What shapes do to the gaps of their own lips and what the motion wants there, and so the
    width and the jaw as they count: in the built-in head's size, m.

    Lips that rest apart stay so, but where they seal. What presses lips that touch moves them into
    each other: given weights may do that as far as the motion's, and of shapes that are fitted it
    is no part.
    """
    ours, count = builtin_mouth(names), len(SHARES)
    theirs, rest = mixes @ ours.effects, np.zeros(count)
    if own is not None:
        scale = own.width / ours.width
        theirs, rest = own.effects / scale, np.maximum(own.gaps, 0) / scale
    wanted = curves @ ours.effects
    gaps = np.maximum(wanted[:, :count], 0) * (1 - seals[:, None]) - rest * seals[:, None]
    if given is None:
        # Both halves of what presses, and what seals, close no more than lips that rest apart.
        press = mixes[:, [name in PRESS for name in names]].sum(axis=1) == mixes.sum(axis=1)
        press[sealing] = True
        theirs[press, :count] = np.maximum(theirs[press, :count], -rest)
    else:
        least = np.minimum(wanted[:, :count], gaps)
        gaps = np.clip(given @ theirs[:, :count], least, gaps)
    much = np.array([WIDTH, JAW])
    return theirs[:, :count], gaps, much * theirs[:, count:], much * wanted[:, count:]


def _seals(curves: dict[str, Float64Array], opening_mm: Float32Array) -> Float64Array:
    """(frame,) how far lips that touch are sealed, as for a p: pressed, or closed over the jaw."""
    pressed = np.max([curves[name] for name in PRESS], axis=0) / VISEME_SHAPES["PP"][PRESS[0]]
    jaw, over = curves["jawOpen"], curves["mouthClose"]
    closed = np.minimum(over / np.maximum(jaw, 1e-6), 1) * np.minimum(over / ROLLED, 1)
    near = np.clip((APART_MM - opening_mm) / (APART_MM - SEALED_MM), 0, 1).astype(np.float64)
    return near * np.clip(np.maximum(pressed, closed), 0, 1)


@lru_cache(maxsize=1)
def _skin(head: HeadModel, names: tuple[str, ...]) -> tuple[Float64Array, Float64Array, int]:
    """(curve, curve) products of what the shapes of a mouth do to the skin, m², plain and as places
    count, and how many places there are: all that a fit needs of the mesh."""
    columns = [head.expression_index(name) for name in names]
    basis = head.expression_basis[columns].astype(np.float64)
    moved = np.linalg.norm(basis, axis=2).max(axis=0) > MOVED_M
    lips = np.zeros(head.vertex_count)
    lips[head.regions.get("lips", [])] = 1
    parts = basis[:, moved].reshape(len(columns), -1)
    rows = parts * np.repeat(1 + (LIPS - 1) * lips[moved], 3)
    return parts @ parts.T, rows @ rows.T, max(1, int(moved.sum()))
