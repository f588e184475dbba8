"""A person's speaking style, estimated from a few seconds of motion (VOCA 2019, section 7.2).

The paper mixes styles convexly and leaves estimating the mix for the future. One-hot vectors
enter before a hyperbolic tangent, so the output is not linear in the mix and no least squares
solves it: shares are moved from style to style, in ever smaller steps, as long as the network's
motion comes closer to the observed one.

Closeness is measured by a Schatten quasi-norm of the residual, between the sum of squares and the
determinant of its covariance (maximum likelihood where the spread of the noise is unknown). A
misrecognised phone moves jaw and lips by millimetres and drowns a sum of squares; a lopsided smile
is small, but lies where recognition errs little.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from elocute.array_types import Float64Array
from elocute.errors import ModelError
from elocute.models.model_shapes import basis_of
from elocute.models.protocol import FrameSpan, SpeechFeatures, SpeechModel
from elocute.motion.vertex_motion import MM, VertexMotion
from elocute.numerics.resampling import frame_places, frames_in, read_rows

SECONDS_LEAST, SECONDS_MOST = 0.5, 60.0
STEPS = (0.5, 0.25, 0.125, 0.0625, 0.03125, 0.015625)
POWER = 0.25  # of variances in the loss: 1 is the sum of squares, towards 0 the determinant
BEYOND_S = 1.0  # of sound after the last frame: more than any model looks ahead
SHARE_LEAST = 0.005  # smaller shares are left out of the mix
GAIN_LEAST = 1e-5  # of the error: smaller gains are noise


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
    """

    mix: dict[str, float]
    best_style: str
    error_mm: float
    styles: dict[str, float]
    seconds: float

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
        }


@dataclass(frozen=True, eq=False)
class ObservedMotion:
    """A piece of motion over its own neutral face, and the features of its speech.

    Parameters
    ----------
    speech : SpeechFeatures
        As the model needs them.
    motion : VertexMotion
        In the model's topology.
    """

    speech: SpeechFeatures
    motion: VertexMotion


@dataclass(frozen=True, eq=False)
class _Target:
    """A take in orthonormal coordinates of what the model can do: distances are those of vertices.

    Parameters
    ----------
    speech : SpeechFeatures
        As far as these frames need them.
    places : (frame, direction) float64
        Millimetres, at the model's frame rate.
    beyond : float
        What no weights reach, mm², summed over frames and vertices.
    """

    speech: SpeechFeatures
    places: Float64Array
    beyond: float


def fit_style(model: SpeechModel, takes: Sequence[ObservedMotion]) -> StyleFit:
    """Find the convex mix of a model's styles that best explains some recordings.

    Parameters
    ----------
    model : SpeechModel
        With styles.
    takes : sequence of ObservedMotion
        Motions and the features of their speech, together half a second or more; of each the first
        minute is used.

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
    mix = search(problem.loss, corners[nearest])
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
    )


def search(loss: Callable[[Float64Array], float], start: Float64Array) -> Float64Array:
    """(style,) on the simplex: give shares from one style to another while the loss falls.

    Exchanges between two styles span all directions on the simplex, so where none helps at the
    smallest step there is no better mix nearby.
    """
    mix = start.astype(np.float64)
    value = loss(mix)
    for step in STEPS:
        while True:
            tried = [(loss(other), other) for other in _exchanges(mix, step)]
            best, other = min(tried, key=lambda pair: pair[0], default=(value, mix))
            if not value - best > GAIN_LEAST * value:
                break
            value, mix = best, other
    return mix


def _exchanges(mix: Float64Array, step: float) -> list[Float64Array]:
    found = []
    for giver in np.flatnonzero(mix > 1e-9):
        for taker in range(len(mix)):
            if taker != giver:
                other, given = mix.copy(), min(step, mix[giver])
                other[giver] -= given
                other[taker] += given
                found.append(other)
    return found


class _Problem:
    """The loss over all takes; shapes (component, direction) are the model's, in mm."""

    def __init__(
        self, model: SpeechModel, shapes: Float64Array, targets: Sequence[_Target], vertices: int
    ) -> None:
        self.model, self.shapes, self.targets = model, shapes, targets
        frames = sum(len(target.places) for target in targets)
        self.seconds, self.per = frames / model.fps, max(frames, 1) * vertices

    def loss(self, mix: Float64Array) -> float:
        """mm² a vertex: (Σ λ^p)^(1/p), λ the residual's variances along its axes, within reach."""
        products = sum(residual.T @ residual for residual in self._residuals(mix))
        if not np.isfinite(products).all():
            return math.nan
        variances = np.maximum(np.linalg.eigvalsh(products), 0) / self.per
        return float(np.power(variances, POWER).sum() ** (1 / POWER))

    def error_mm(self, mix: Float64Array) -> float:
        """mm: root of the mean squared distance of vertices."""
        within = sum(float(np.square(residual).sum()) for residual in self._residuals(mix))
        return math.sqrt((within + sum(target.beyond for target in self.targets)) / self.per)

    def _residuals(self, mix: Float64Array) -> Iterator[Float64Array]:
        """(frame, direction) mm of every take: the model's motion less the observed one."""
        style = self.model.mix(dict(zip(self.model.styles, mix.tolist(), strict=True)))
        for target in self.targets:
            span = FrameSpan.whole(len(target.places), self.model.fps)
            weights = self.model.weights(target.speech, style, span)
            yield weights @ self.shapes - target.places


def _problem(model: SpeechModel, takes: Sequence[ObservedMotion]) -> _Problem:
    """The loss over these takes. Raises ModelError where they are too short together."""
    basis = basis_of(model.components, model.basis).astype(np.float64)
    directions, triangle = np.linalg.qr(basis.reshape(len(basis), -1).T)
    targets = [_target(model, take, directions) for take in takes]
    problem = _Problem(model, MM * triangle.T, targets, basis.shape[1])
    if problem.seconds < SECONDS_LEAST:
        raise ModelError.about(
            "motion",
            found=f"{problem.seconds:.2f} s of it with sound",
            allowed=f"{SECONDS_LEAST} s or more",
        )
    return problem


def _target(model: SpeechModel, take: ObservedMotion, directions: Float64Array) -> _Target:
    """A take at the model's frame rate, as far as it has both sound and motion.

    directions (3 · vertex, direction) is orthonormal.
    """
    if take.motion.vertex_count * 3 != len(directions):
        raise ModelError.about(
            "motion",
            found=f"{take.motion.vertex_count} vertices",
            allowed=f"{len(directions) // 3}, the topology that {model.name} moves",
        )
    fps, features = model.fps, take.speech.features
    motion, speech_s = _at_rate(take.motion, fps), len(features.values) / features.rate
    frames = min(motion.frame_count, round(speech_s * fps), round(SECONDS_MOST * fps))
    rest = np.asarray(motion.template, np.float64) * MM
    places, beyond = [], 0.0
    for block in motion.cut(frames).blocks():
        moved = (block - rest).reshape(len(block), -1)
        places.append(moved @ directions)
        beyond += float(np.square(moved - places[-1] @ directions.T).sum())
    rows = math.ceil((frames / fps + BEYOND_S) * features.rate)
    speech = SpeechFeatures(replace(features, values=features.values[:rows]))
    return _Target(speech, np.concatenate(places), beyond)


def _at_rate(motion: VertexMotion, fps: float) -> VertexMotion:
    """The first SECONDS_MOST of it, linear between frames."""
    motion = motion.cut(math.ceil(SECONDS_MOST * motion.fps) + 1)
    if motion.fps == fps:
        return motion
    count = frames_in(motion.frame_count / motion.fps, fps)
    values = read_rows(np.asarray(motion.values), frame_places(0, count, motion.fps, fps))
    return VertexMotion(values, motion.template, fps, motion.basis)
