"""From a trained decoder to curves or motion."""

from __future__ import annotations

import math
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.articulation.driver import make_contacts
from elocute.articulation.style import Style, parse_mix
from elocute.audio.features import Features
from elocute.audio.waveform import Waveform
from elocute.errors import ModelError
from elocute.head.builtin import load_builtin_head
from elocute.head.model import HeadModel
from elocute.motion.curves import Curves
from elocute.motion.motion import Motion
from elocute.synthesis.crnn import CrnnModel
from elocute.synthesis.crnn_stream import stream_weights
from elocute.synthesis.rules import Styled
from elocute.synthesis.speech_shapes import as_builtin, speech_names
from elocute.synthesis.style_file import read_mix
from elocute.synthesis.voca import VocaModel

Array = NDArray[np.float32]
EVEN = "even"
"""The style that is all learned styles in equal shares."""


def style_of(model: VocaModel, style: str | Style) -> Array:
    """(style,) shares: a name, a mix, or `even`; `plain` is even where nobody is called so.

    A .json file holds a mix as `elocute style fit` writes it. Raises ModelError for a Style of
    the rule-based driver and names never learned.
    """
    if isinstance(style, Style):
        raise ModelError.about(
            f"model {model.path.name}", found="a Style of the articulation model",
            allowed=", ".join(model.record.styles),
        )  # fmt: skip
    unnamed = style == "plain" and "plain" not in model.record.styles
    if style == EVEN or unnamed:
        return model.even_style
    if style.lower().endswith(".json") and style not in model.record.styles:
        return model.style_vector(read_mix(style))
    return model.style_vector(parse_mix(style))


def basis_of(model: Styled) -> Array:
    """(component, vertex, 3) m that a model's weights weigh: its own, or the built-in shapes.

    Raises ModelError for a component that the built-in head has no shape for.
    """
    own = model.basis
    return builtin_basis(model.record.components) if own is None else own


def builtin_basis(components: tuple[str, ...]) -> Array:
    """(component, vertex, 3) m: the built-in head's shapes of these names. Raises ModelError."""
    head = load_builtin_head()
    unknown = [name for name in components if name not in head.expression_names]
    if unknown:
        raise ModelError.about(
            "model", found=f"weights of {', '.join(unknown[:5])}",
            allowed="shapes of the built-in head",
        )  # fmt: skip
    return head.expression_basis[[head.expression_names.index(name) for name in components]]


def learned_curves(
    model: VocaModel, features: Features, log_posteriors: Array, style: Array, *,
    duration_s: float, fps: float, strength: float,
) -> Curves:  # fmt: skip
    """Curves of a model that weighs the built-in head's shapes, with contacts and rests made."""
    weights = model.weights(features, style)
    values = resampled(weights, model.record.fps, duration_s, fps)
    curves = Curves(np.clip(values * strength, 0, 1), model.record.components, fps)
    return make_contacts(curves, log_posteriors, features.rate)


def learned_motion(
    model: VocaModel, head: HeadModel, features: Features, style: Array, *,
    duration_s: float, fps: float, strength: float,
) -> Motion:  # fmt: skip
    """Motion of a model that carries its own basis, on a head of the topology it was trained in.

    Raises ModelError where the head has another number of vertices.
    """
    basis = model.basis
    assert basis is not None
    moving = _moving(head, basis, model.path, "voca")
    names = (*moving.expression_names[:-1], "vocaMean")
    moving = replace(moving, expression_names=names)
    weights = resampled(model.weights(features, style), model.record.fps, duration_s, fps)
    return Motion(moving, weights * np.float32(strength), fps)


def crnn_curves(
    model: CrnnModel, sound: Waveform, log_posteriors: Array, rate: float, *,
    duration_s: float, fps: float, strength: float,
) -> Curves:  # fmt: skip
    """Curves of a recurrent model in the built-in topology, with contacts and rests made."""
    values = as_builtin(stream_weights(model, sound), model.basis)
    wanted = resampled(values, model.record.fps, duration_s, fps)
    curves = Curves(np.clip(wanted * strength, 0, 1), speech_names(), fps)
    return make_contacts(curves, log_posteriors, rate)


def crnn_motion(
    model: CrnnModel, head: HeadModel, sound: Waveform, *,
    duration_s: float, fps: float, strength: float,
) -> Motion:  # fmt: skip
    """Motion of a recurrent model on a head of the topology it was trained in.

    Raises ModelError where the head has another number of vertices.
    """
    moving = _moving(head, model.basis, model.path, "speech")
    weights = resampled(stream_weights(model, sound), model.record.fps, duration_s, fps)
    return Motion(moving, weights * np.float32(strength), fps)


def _moving(head: HeadModel, basis: Array, path: Path, stem: str) -> HeadModel:
    if head.vertex_count != basis.shape[1]:
        raise ModelError.about(
            f"head {head.name!r}", found=f"{head.vertex_count} vertices",
            allowed=f"{basis.shape[1]}, the topology that {path.name} was trained in",
        )  # fmt: skip
    names = tuple(f"{stem}{index:03d}" for index in range(len(basis)))
    return replace(head, expression_names=names, expression_basis=basis)


def resampled(weights: Array, rate: float, duration_s: float, fps: float) -> Array:
    """(frame, component) at `fps` over the whole sound, linear between, held at the end."""
    count = max(1, math.ceil(duration_s * fps - 1e-6))
    places = np.minimum(np.arange(count) * (rate / fps), len(weights) - 1)
    below = np.floor(places).astype(int)
    above = np.minimum(below + 1, len(weights) - 1)
    share = (places - below)[:, None].astype(np.float32)
    return (weights[below] * (1 - share) + weights[above] * share).astype(np.float32)
