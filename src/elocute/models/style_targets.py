"""Takes that a model's styles are compared with, in coordinates of what it can do."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from elocute.array_types import Float32Array, Float64Array
from elocute.audio.features import Features
from elocute.errors import ModelError
from elocute.head.builtin import load_builtin_head
from elocute.models.model_shapes import basis_of
from elocute.models.protocol import FrameSpan, SpeechFeatures, SpeechModel
from elocute.motion.vertex_motion import MM, VertexMotion
from elocute.numerics.resampling import frame_places, frames_in, read_rows

SECONDS_MOST = 60.0
BEYOND_S = 1.0  # of sound after the last frame: more than any model looks ahead


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
class Target:
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


def directions_of(model: SpeechModel) -> tuple[Float64Array, Float64Array]:
    """What a model can do: (3 · vertex, direction), orthonormal, and its shapes along them, mm.

    The shapes are (component, direction).
    """
    basis = basis_of(model.components, model.basis).astype(np.float64)
    directions, triangle = np.linalg.qr(basis.reshape(len(basis), -1).T)
    return directions, MM * triangle.T


def finished_weights(
    model: SpeechModel, speech: SpeechFeatures, style: Any, span: FrameSpan
) -> Float32Array:
    """What a model does with a face in a style that its `style` or `mix` gave, without blinks.

    The features come with phones where contacts are made from them.

    Returns
    -------
    (frame, component) float32
        Weights on `basis_of(model.components, model.basis)`.
    """
    if model.basis is not None or not model.makes_contacts:
        return model.weights(speech, style, span)
    names = model.components or load_builtin_head().expression_names
    return model.curves(speech, style, span).select(names).values


def target_of(model: SpeechModel, take: ObservedMotion, directions: Float64Array) -> Target:
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
    places, beyond = _projected(motion.cut(frames), directions)
    end_s = frames / fps + BEYOND_S
    phones = None if take.speech.phones is None else _until(take.speech.phones, end_s)
    speech = replace(take.speech, features=_until(features, end_s), phones=phones)
    return Target(speech, places, beyond)


def _projected(motion: VertexMotion, directions: Float64Array) -> tuple[Float64Array, float]:
    """(frame, direction) mm of a motion, and mm² of it that lie beyond these directions."""
    if motion.basis is not None:
        shapes = MM * np.asarray(motion.basis, np.float64).reshape(len(motion.basis), -1)
        weights = np.asarray(motion.values, np.float64)
        places = weights @ (shapes @ directions)
        whole = float(np.einsum("fi,ij,fj->", weights, shapes @ shapes.T, weights, optimize=True))
        return places, max(whole - float(np.square(places).sum()), 0.0)
    rest, projections, beyond = np.asarray(motion.template, np.float64) * MM, [], 0.0
    for block in motion.blocks():
        moved = (block - rest).reshape(len(block), -1)
        projections.append(moved @ directions)
        beyond += float(np.square(moved - projections[-1] @ directions.T).sum())
    return np.concatenate(projections), beyond


def _until(features: Features, end_s: float) -> Features:
    """The rows of the first seconds."""
    return replace(features, values=features.values[: math.ceil(end_s * features.rate)])


def _at_rate(motion: VertexMotion, fps: float) -> VertexMotion:
    """The first SECONDS_MOST of it, linear between frames."""
    motion = motion.cut(math.ceil(SECONDS_MOST * motion.fps) + 1)
    if motion.fps == fps:
        return motion
    count = frames_in(motion.frame_count / motion.fps, fps)
    values = read_rows(np.asarray(motion.values), frame_places(0, count, motion.fps, fps))
    return VertexMotion(values, motion.template, fps, motion.basis)
