"""Measures how a trained model errs in the styles it learned, and what a style fit makes of it.

A network errs by more than its styles differ, and not alike in all directions: a misheard phone
moves jaw and lips by millimetres, a lopsided smile never. What it errs by in the clips that it
learned from says how much a distance along each direction means, and how far it over- or
undershoots.
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from elocute.array_types import Float64Array
from elocute.errors import ModelError
from elocute.models.protocol import FrameSpan, SpeechModel
from elocute.models.style_targets import ObservedMotion, directions_of, finished_weights, target_of

GAIN_LEAST, GAIN_MOST = 0.25, 4.0
MOVES_LEAST = 1e-6  # of a weight's mean square: one that hardly moves has no gain
FLOOR = 2e-3  # of the mean variance: directions of no error would decide alone
WEAKEST = 1e-6  # of the strongest shape: nothing distinguishes weaker ones
DIGITS = 6


@dataclass(frozen=True, eq=False)
class StyleErrors:
    """A model's errors on clips in their own styles, in weights of its shapes.

    Parameters
    ----------
    gain : (component,) float64
        What its weights are multiplied by to come closest to the recorded ones.
    covariance : (component, component) float64
        Second moments of what remains.
    """

    gain: Float64Array
    covariance: Float64Array

    def record(self) -> dict[str, Any]:
        """For JSON."""
        return {
            "gain": _rounded(self.gain),
            "covariance": [_rounded(row) for row in self.covariance],
        }

    @classmethod
    def from_record(cls, record: Any, components: int) -> StyleErrors:
        """The errors that `record` gave as JSON, of a model with so many weights.

        Raises ModelError for anything else.
        """
        try:
            gain = np.array(record["gain"], np.float64)
            covariance = np.array(record["covariance"], np.float64)
            fits = gain.shape == (components,) and covariance.shape == (components, components)
            if not fits or not np.isfinite(gain).all() or not np.isfinite(covariance).all():
                raise ValueError
        except (KeyError, TypeError, ValueError, OverflowError) as error:
            raise ModelError.about(
                "style errors",
                found="other numbers than the model has weights",
                allowed=f"{components} gains and their covariance",
            ) from error
        return cls(gain, covariance)

    def whitening(self, shapes: Float64Array) -> Float64Array:
        """A matrix after which the errors have the same size in every direction of shapes, mm.

        Returns
        -------
        (direction, direction) float64
        """
        errors = shapes.T @ self.covariance @ shapes
        variances, axes = np.linalg.eigh(errors)
        floor = FLOOR * max(float(variances.mean()), 1e-12)
        return axes / np.sqrt(np.maximum(variances, 0) + floor)


def measure_style_errors(
    model: SpeechModel, takes: Iterable[tuple[str, ObservedMotion]]
) -> StyleErrors:
    """How a model errs where it speaks in the style of each recording that it learned.

    Raises ModelError for an unknown style, no recording, and motions of another topology.
    """
    directions, shapes = directions_of(model)
    to_weights = np.linalg.pinv(shapes, rcond=WEAKEST)

    def pairs() -> Iterator[tuple[Float64Array, Float64Array]]:
        for style, take in takes:
            target = target_of(model, take, directions)
            span = FrameSpan.whole(len(target.places), model.fps)
            weights = finished_weights(model, target.speech, model.style(style), span)
            yield target.places @ to_weights, weights.astype(np.float64)

    return errors_of(pairs())


def errors_of(pairs: Iterable[tuple[Float64Array, Float64Array]]) -> StyleErrors:
    """The errors of a model on clips: weights (frame, component) as recorded and as it gives them.

    Raises ModelError for no clip.
    """
    rows = list(pairs)
    if not rows:
        raise ModelError.about("style errors", found="no clip", allowed="one or more")
    recorded = np.concatenate([one for one, _ in rows])
    modelled = np.concatenate([other for _, other in rows])
    squares = np.square(modelled).mean(axis=0)
    moving = squares > MOVES_LEAST
    products = (modelled * recorded).mean(axis=0)
    gain = np.where(moving, products / np.where(moving, squares, 1.0), 1.0)
    gain = np.clip(gain, GAIN_LEAST, GAIN_MOST)
    residual = recorded - modelled * gain
    return StyleErrors(gain, residual.T @ residual / len(residual))


def _rounded(values: Float64Array) -> list[float]:
    return [float(f"{value:.{DIGITS}g}") for value in values]
