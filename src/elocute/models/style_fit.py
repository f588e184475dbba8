"""A person's speaking style, estimated from a few seconds of motion (VOCA 2019, section 7.2).

The paper mixes styles convexly and leaves estimating the mix for the future. Shares are moved from
style to style, in ever smaller steps, as long as the model's motion comes closer to the observed
one. What is compared is the motion that `animate` shows, contacts and rests among it: people's lips
meet as well. A network's outputs are mixed, so each style is computed once.

Where a model knows how it errs (`StyleErrors`), closeness is a squared distance with each direction
in proportion to these errors: maximum likelihood where they are normal. Otherwise it is a
Schatten quasi-norm of the residual, between the sum of squares and the determinant of its
covariance (maximum likelihood where the spread of the noise is unknown). A misrecognised phone
moves jaw and lips by millimetres and drowns a sum of squares; a lopsided smile is small, but lies
where recognition errs little.

A new style beyond the mix is a vector at the network's input, found in the same way; of the rules'
styles, the numbers with which the mouth moves as far as the person's.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import asdict, dataclass, replace
from typing import Any

import numpy as np

from elocute.array_types import Float64Array
from elocute.articulation.style import Style
from elocute.errors import ModelError
from elocute.head.builtin import load_builtin_head
from elocute.models.protocol import FrameSpan, SpeechModel
from elocute.models.style_errors import StyleErrors
from elocute.models.style_mixes import MixedStyle
from elocute.models.style_targets import (
    ObservedMotion,
    Target,
    directions_of,
    finished_weights,
    target_of,
)
from elocute.motion.motion import Motion
from elocute.motion.mouth_measures import TRACKED_MEASURES, measure_as_tracked
from elocute.settings import setting_of

SECONDS_LEAST = 0.5
STEPS = (0.5, 0.25, 0.125, 0.0625, 0.03125, 0.015625)
POWER = 0.25  # of variances in the loss: 1 is the sum of squares, towards 0 the determinant
SHARE_LEAST = 0.005  # smaller shares are left out of the mix
GAIN_LEAST = 1e-5  # of the error: smaller gains are noise
EXTRA = 0.1  # of what the model is known to err by: each further style must explain more than that
# The same for a vector as far from the middle of all styles as each of them is.
RIDGE = 0.05
PERSONAL_ROUNDS = 3
SMILE_MM = 12.7  # that a whole smile widens the mouth


@dataclass(frozen=True)
class StyleFit:
    """The mix of styles that explains a motion best.

    Parameters
    ----------
    mix : dict
        Share per style, largest first, summing to one.
    best_style : str
        The single style that explains it best.
    error_mm : float
        Distance of vertices (root mean square) between the model in this mix and the motion.
    styles : dict
        The same error for every style alone, mm.
    seconds : float
        How much motion was used.
    vector : dict or None
        A new style: what the network is given for each style, in place of the mix; or the numbers
        of a `Style`.
    vector_error_mm : float or None
        The error in it, mm.
    """

    mix: dict[str, float]
    best_style: str
    error_mm: float
    styles: dict[str, float]
    seconds: float
    vector: dict[str, float] | None = None
    vector_error_mm: float | None = None

    @property
    def text(self) -> str:
        """As `style` takes it: NAME:SHARE,…"""
        return ",".join(f"{name}:{share:.3f}" for name, share in self.mix.items())

    def record(self) -> dict[str, Any]:
        """For JSON, without the mix."""
        return {
            "best_style": self.best_style,
            "error_mm": self.error_mm,
            "styles_mm": self.styles,
            "seconds": self.seconds,
            **({"vector_error_mm": self.vector_error_mm} if self.vector is not None else {}),
        }


def fit_style(
    model: SpeechModel, takes: Sequence[ObservedMotion], *, new: bool = False
) -> StyleFit:
    """Find the convex mix of a model's styles that best explains some recordings.

    Parameters
    ----------
    model : SpeechModel
        With styles.
    takes : sequence of ObservedMotion
        Motions and the features of their speech, together half a second or more; of each the first
        minute is used. Features with phones where the model makes contacts from them.
    new : bool
        Whether a new style beyond the mix is sought too: a vector at the network's input, drawn
        towards the middle of its styles, or the numbers of a `Style`.

    Returns
    -------
    StyleFit

    Raises
    ------
    ModelError
        For motions of another topology, too short, not finite or none, and for a model without
        styles.

    References
    ----------
    VOCA 2019, section 7.2 mixes styles convexly and leaves estimating the mix for the future.
    """
    if not model.styles:
        raise ModelError.about(
            f"model {model.name}",
            found="no styles",
            allowed="a model that has some: "
            "articulation, voca, or one that elocute train voca wrote",
        )
    problem = _problem(model, takes)
    names = model.styles
    corners = np.eye(len(names))
    alone = [problem.loss(corner) for corner in corners]
    if not np.isfinite(alone).all():
        raise ModelError.about(
            "style fit",
            found="NaN or infinity in the motion, or in the model's",
            remedy="check the corpus: elocute corpus check",
        )
    nearest = int(np.argmin(alone))
    mix = search(problem.loss_of_few, corners[nearest])
    vector_fields: dict[str, Any] = {}
    if new:
        numbers, style = problem.new_style(mix)
        vector_fields = {
            "vector": {name: round(float(each), 6) for name, each in numbers.items()},
            "vector_error_mm": problem.error_in_mm(style),
        }
    shares = np.where(mix < SHARE_LEAST, 0, mix)
    shares /= shares.sum()
    order = [int(index) for index in np.argsort(-shares) if shares[index] > 0]
    return StyleFit(
        mix={names[index]: round(float(shares[index]), 6) for index in order},
        best_style=names[nearest],
        error_mm=problem.error_mm(shares),
        styles={
            name: problem.error_mm(corner) for name, corner in zip(names, corners, strict=True)
        },
        seconds=problem.seconds,
        **vector_fields,
    )


def search(
    loss: Callable[[Float64Array], float],
    start: Float64Array,
    moves: Callable[[Float64Array, float], list[Float64Array]] | None = None,
) -> Float64Array:
    """(style,) on the simplex: give shares from one style to another while the loss falls.

    Exchanges between two styles span all directions on the simplex; where a style gives all it has
    to the others, in proportion to theirs, a narrow valley is left. Other moves search elsewhere.
    """
    moves = moves or _exchanges
    mix = start.astype(np.float64)
    value = loss(mix)
    for step in STEPS:
        while True:
            tried = [(loss(other), other) for other in moves(mix, step)]
            best, other = min(tried, key=lambda pair: pair[0], default=(value, mix))
            if not value - best > GAIN_LEAST * value:
                break
            value, mix = best, other
    return mix


def _exchanges(mix: Float64Array, step: float) -> list[Float64Array]:
    exchanges = []
    for giver in np.flatnonzero(mix > 1e-9):
        for taker in range(len(mix)):
            if taker != giver:
                other, amount = mix.copy(), min(step, mix[giver])
                other[giver] -= amount
                other[taker] += amount
                exchanges.append(other)
    # What a style should not have at all may belong to several others.
    for giver in np.flatnonzero((mix > 1e-9) & (mix < 1)):
        without = mix * (np.arange(len(mix)) != giver)
        exchanges.append(without / without.sum())
    return exchanges


class _Problem:
    """The loss over all takes; shapes (component, direction) are the model's, in mm."""

    def __init__(
        self, model: SpeechModel, shapes: Float64Array, targets: Sequence[Target], vertices: int
    ) -> None:
        self.model, self.shapes, self.targets = model, shapes, targets
        frames = sum(len(target.places) for target in targets)
        self.seconds, self.per = frames / model.fps, max(frames, 1) * vertices
        errors: StyleErrors | None = getattr(model, "style_errors", None)
        self._gain = np.ones(len(shapes)) if errors is None else errors.gain
        self._white = None if errors is None else errors.whitening(shapes)
        # The loss where the model errs as it is known to; 0 where nothing is known.
        frames_share = 0.0 if self._white is None else frames / self.per
        self._expected = len(shapes.T) * frames_share
        self._alone: dict[int, list[Float64Array]] = {}

    def loss(self, mix: Float64Array) -> float:
        """How far the motion in a mix is from the observed one; NaN where it is not finite."""
        return self._distance(self._residuals(mix))

    def loss_of_few(self, mix: Float64Array) -> float:
        """The loss where a further style has to be worth it.

        Some styles lie between others: half plain and half mumble is much like calm.
        """
        further = np.count_nonzero(mix > SHARE_LEAST) - 1
        return self.loss(mix) + EXTRA * self._expected * further

    def error_mm(self, mix: Float64Array) -> float:
        """mm: root of the mean squared distance of vertices."""
        return self._error_mm(self._style(mix))

    def error_in_mm(self, style: Any) -> float:
        """The same for a style beyond the mix."""
        return self._error_mm(style)

    def new_style(self, mix: Float64Array) -> tuple[dict[str, float], Any]:
        """Numbers of a style beyond the mix, beginning with it (style,), that explain most.

        A network's input for each of its styles; or how far a person's mouth moves, by numbers of
        the rules.
        """
        start = self._style(mix)
        if isinstance(start, Style):
            style = self._personal(Style())
            return asdict(style), style
        vector = self._vector(mix)
        return dict(zip(self.model.styles, vector.tolist(), strict=True)), _at_input(vector)

    def _personal(self, style: Style) -> Style:
        """The numbers with which the model's mouth moves as far as the observed one.

        Least squares would make it small: a model that errs is nearest where it hardly moves.
        """
        span = np.linalg.inv(self.shapes)
        seen = _mouths([target.places @ span for target in self.targets], self.model.fps)
        for _ in range(PERSONAL_ROUNDS):
            weights = [self._weights(target, style) for target in self.targets]
            mine = _mouths(weights, self.model.fps)
            further = dict(zip(TRACKED_MEASURES, seen.std(axis=0) / mine.std(axis=0), strict=True))
            opened = math.sqrt(further["opening_mm"] * further["jaw_mm"])
            factors = {
                "amplitude": opened,
                "spread": further["width_mm"],
                "rounding": further["protrusion_mm"],
                "upper_lip": further["upper_lip_mm"] / opened,
            }
            numbers = {name: getattr(style, name) * by for name, by in factors.items()}
            wider = seen.mean(axis=0) - mine.mean(axis=0)
            numbers["smile"] = style.smile + wider[TRACKED_MEASURES.index("width_mm")] / SMILE_MM
            for name, number in numbers.items():
                known = setting_of(Style, name)
                numbers[name] = float(np.clip(number, known.low, known.high))
            style = replace(style, **numbers)
        return style

    def _vector(self, mix: Float64Array) -> Float64Array:
        """(style,) the network's input, beginning with a mix (style,), that explains most."""
        middle = 1 / len(mix)
        radius = max(1 - middle, middle)

        def loss(vector: Float64Array) -> float:
            far = float(np.square(vector - middle).sum()) / radius
            distance = self._loss_in(_at_input(vector))
            return distance + RIDGE * far * (self._expected or distance)

        starts = [mix, *np.eye(len(mix))[np.argsort(-mix)[:1]]]
        return search(loss, min(starts, key=loss), _steps)

    def _loss_in(self, style: Any) -> float:
        weights = (self._weights(target, style) for target in self.targets)
        places = (each * self._gain @ self.shapes for each in weights)
        pairs = zip(places, self.targets, strict=True)
        return self._distance(each - target.places for each, target in pairs)

    def _distance(self, residuals: Iterable[Float64Array]) -> float:
        products = sum(residual.T @ residual for residual in residuals)
        if not np.isfinite(products).all():
            return math.nan
        if self._white is not None:
            return float(np.sum(self._white * (products @ self._white))) / self.per
        # mm² a vertex: (Σ λ^p)^(1/p), λ the residual's variances along its axes, within reach.
        variances = np.maximum(np.linalg.eigvalsh(products), 0) / self.per
        return float(np.power(variances, POWER).sum() ** (1 / POWER))

    def _error_mm(self, style: Any) -> float:
        within = sum(
            float(np.square(self._weights(target, style) @ self.shapes - target.places).sum())
            for target in self.targets
        )
        return math.sqrt((within + sum(target.beyond for target in self.targets)) / self.per)

    def _residuals(self, mix: Float64Array) -> Iterator[Float64Array]:
        """(frame, direction) mm of every take: the model's motion less the observed one."""
        style = self._style(mix)
        if not isinstance(style, MixedStyle):
            for target in self.targets:
                yield self._weights(target, style) * self._gain @ self.shapes - target.places
            return
        used = np.flatnonzero(mix)
        for place in range(len(self.targets)):
            each = [mix[style] * self._residuals_alone(style)[place] for style in used.tolist()]
            yield np.sum(each, axis=0)

    def _residuals_alone(self, style: int) -> list[Float64Array]:
        """(frame, direction) mm of every take, in one style: those of a mix are a mix of these."""
        if style not in self._alone:
            chosen = self._style(np.eye(len(self.model.styles))[style])
            self._alone[style] = [
                self._weights(target, chosen) * self._gain @ self.shapes - target.places
                for target in self.targets
            ]
        return self._alone[style]

    def _style(self, mix: Float64Array) -> Any:
        return self.model.mix(dict(zip(self.model.styles, mix.tolist(), strict=True)))

    def _weights(self, target: Target, style: Any) -> Float64Array:
        """(frame, component) as the model moves, finished where it moves the built-in head."""
        span = FrameSpan.whole(len(target.places), self.model.fps)
        return finished_weights(self.model, target.speech, style, span).astype(np.float64)


def _at_input(vector: Float64Array) -> MixedStyle:
    return MixedStyle(vector[None].astype(np.float32), np.ones(1, np.float32))


def _steps(vector: Float64Array, step: float) -> list[Float64Array]:
    """Vectors a step away, along each axis and along the way from the middle of all styles."""
    axes = np.eye(len(vector)) * step
    outward = (vector - 1 / len(vector)) * step
    return [vector + sign * way for way in (*axes, outward) for sign in (1, -1)]


def _mouths(weights: Iterable[Float64Array], fps: float) -> Float64Array:
    """(frame, measure) `TRACKED_MEASURES` of the built-in head, mm; each take less its mean, and
    the mean of all added."""
    head = load_builtin_head()
    takes = [
        measure_as_tracked(Motion(head, each.astype(np.float32), fps)).values for each in weights
    ]
    apart = np.concatenate([take - take.mean(axis=0) for take in takes])
    return (apart + np.concatenate(takes).mean(axis=0)).astype(np.float64)


def _problem(model: SpeechModel, takes: Sequence[ObservedMotion]) -> _Problem:
    """The loss over these takes. Raises ModelError where they are too short together."""
    directions, shapes = directions_of(model)
    targets = [target_of(model, take, directions) for take in takes]
    problem = _Problem(model, shapes, targets, len(directions) // 3)
    if problem.seconds < SECONDS_LEAST:
        raise ModelError.about(
            "motion",
            found=f"{problem.seconds:.2f} s of it with sound",
            allowed=f"{SECONDS_LEAST} s or more",
        )
    return problem
