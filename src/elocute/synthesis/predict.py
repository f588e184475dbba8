"""A model's answer to clips of a corpus, frame for frame: what evaluations compare."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import lru_cache
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.articulation.driver import articulate, make_contacts
from elocute.articulation.style import STYLES, mix_styles, resolve_style
from elocute.audio.features import Features
from elocute.audio.waveform import Waveform
from elocute.brief import one_line
from elocute.corpus.store import Corpus
from elocute.corpus.track import Track
from elocute.encoders.registry import resolve_encoder
from elocute.errors import ModelError
from elocute.head.builtin import load_builtin_head
from elocute.motion.curves import Curves
from elocute.synthesis.animate import ARTICULATION
from elocute.synthesis.crnn import CrnnModel
from elocute.synthesis.crnn_stream import stream_weights
from elocute.synthesis.learned import EVEN, builtin_basis, resampled, style_of
from elocute.synthesis.trained import open_trained
from elocute.synthesis.voca import VocaModel

Array = NDArray[np.float32]
HEARD_CLIPS = 2  # kept, so that many styles of one clip are heard once


@dataclass(frozen=True, eq=False)
class Predictor:
    """A model behind one function.

    styles      names that it knows
    hear        sound to features, the costly part
    weights     (features, style, frame count, frames per second) to (frame, component)
    components  names of its weights, () where it has a basis of its own
    basis       (component, vertex, 3) m, or None
    """

    styles: tuple[str, ...]
    hear: Callable[[Waveform], Features]
    weights: Callable[[Features, str, int, float], Array]
    components: tuple[str, ...]
    basis: Array | None

    __repr__ = one_line


def open_predictor(model: str | Path, *, contacts: bool = False) -> Predictor:
    """`articulation`, or a trained model (.onnx); nobody blinks, as blinks cannot be heard.

    contacts  rests and closures made as `animate` makes them, instead of the bare network; for
              models that weigh the built-in shapes

    Raises ModelError.
    """
    if str(model) == ARTICULATION:
        encoder = resolve_encoder("phones")
        names = load_builtin_head().expression_names
        return Predictor(tuple(STYLES), encoder, _articulated(names), names, None)
    learned = open_trained(model)
    if isinstance(learned, CrnnModel):
        return _recurrent(learned, contacts)
    record = learned.record
    if contacts and (not record.components or record.encoder != "phones"):
        raise ModelError.about(
            learned.path, found=f"a model that hears with {record.encoder}"
            + ("" if record.components else " and moves by its own basis"),
            allowed="contacts for models that hear phones and weigh the built-in shapes",
        )  # fmt: skip
    return Predictor(
        record.styles, resolve_encoder(record.encoder), _learned(learned, contacts),
        record.components, learned.basis,
    )  # fmt: skip


def _recurrent(model: CrnnModel, contacts: bool) -> Predictor:
    """A recurrent model has one style and hears sound itself: what it hears is its answer."""
    if contacts:
        raise ModelError.about(
            model.path, found="a model that moves by its own basis",
            allowed="contacts for models that hear phones and weigh the built-in shapes",
        )  # fmt: skip

    def hear(sound: Waveform) -> Features:
        return Features(stream_weights(model, sound), model.record.fps, "crnn")

    def weights(heard: Features, _style: str, frames: int, fps: float) -> Array:
        return resampled(heard.values, heard.rate, frames / fps, fps)

    return Predictor(("plain",), hear, weights, (), model.basis)


def clip_predictor(predictor: Predictor, corpus: Corpus) -> Callable[[str, str], Track]:
    """(clip, style) to a motion of the clip's length over its subject's neutral face.

    Raises ModelError, before anything is heard, where the corpus has another topology.
    """
    basis = _basis_for(predictor, corpus)

    @lru_cache(HEARD_CLIPS)
    def heard(name: str) -> Features:
        return predictor.hear(corpus.sound(name))

    def predict(name: str, style: str) -> Track:
        entry = corpus.entry(name)
        weights = predictor.weights(heard(name), style, entry.frames, corpus.fps)
        return Track(weights, corpus.template(entry.subject), corpus.fps, basis)

    return predict


def _basis_for(predictor: Predictor, corpus: Corpus) -> Array:
    """(component, vertex, 3) m of the predictor's weights. Raises ModelError."""
    basis, names = predictor.basis, predictor.components
    if basis is None:
        if corpus.basis is not None and set(names) <= set(corpus.components):
            return corpus.basis[[corpus.components.index(name) for name in names]]
        basis = builtin_basis(names)
    if basis.shape[1] != corpus.vertex_count:
        raise ModelError.about(
            corpus.folder, found=f"{corpus.vertex_count} vertices",
            allowed=f"{basis.shape[1]}, the topology that the model moves",
        )  # fmt: skip
    return basis


def _articulated(names: tuple[str, ...]) -> Callable[[Features, str, int, float], Array]:
    def weights(heard: Features, style: str, frames: int, fps: float) -> Array:
        even = dict.fromkeys(STYLES, 1 / len(STYLES))
        chosen = mix_styles(even) if style == EVEN else resolve_style(style)
        quiet = replace(chosen, blink_per_min=0.0)
        curves = articulate(heard.values, heard.rate, frame_count=frames, fps=fps, style=quiet)
        return curves.select(names).values

    return weights


def _learned(model: VocaModel, contacts: bool) -> Callable[[Features, str, int, float], Array]:
    def weights(heard: Features, style: str, frames: int, fps: float) -> Array:
        bare = model.weights(heard, style_of(model, style))
        values = resampled(bare, model.record.fps, frames / fps, fps)
        if not contacts:
            return values
        names = model.record.components
        curves = Curves(np.clip(values, 0, 1), names, fps)
        quiet = replace(STYLES["plain"], blink_per_min=0.0)
        return make_contacts(curves, heard.values, heard.rate, quiet).select(names).values

    return weights
