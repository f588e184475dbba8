"""A model's answer to clips of a corpus, frame for frame: what evaluations compare."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

import numpy as np
from numpy.typing import NDArray

from elocute.corpus.corpus_store import Corpus
from elocute.errors import ModelError
from elocute.head.builtin import load_builtin_head
from elocute.models.hearing import hear
from elocute.models.protocol import Heard, Span, SpeechModel
from elocute.models.styles import basis_of
from elocute.motion.track import Track

Array = NDArray[np.float32]
HEARD_CLIPS = 2  # kept, so that many styles of one clip are heard once


def clip_predictor(
    model: SpeechModel, corpus: Corpus, *, contacts: bool = False
) -> Callable[[str, str], Track]:
    """(clip, style) to a motion of the clip's length over its subject's neutral face.

    contacts  rests and closures made as `animate` makes them, instead of the bare model; for
              models that move the built-in head

    Nobody blinks, as blinks cannot be heard. Raises ModelError, before anything is heard, where
    the corpus has another topology or the model makes no contacts.
    """
    if contacts and not model.makes_contacts:
        raise ModelError.about(
            f"model {model.name}",
            found="one that moves by its own basis",
            allowed="contacts for models that move the built-in head",
        )
    finished = contacts and model.basis is not None
    names = load_builtin_head().expression_names if finished else model.components
    basis = _basis_for(names, None if finished else model.basis, corpus)

    @lru_cache(HEARD_CLIPS)
    def heard(name: str) -> Heard:
        return hear(model, corpus.sound(name), contacts=contacts)[0]

    def predict(name: str, style: str) -> Track:
        entry = corpus.entry(name)
        span, chosen = Span.whole(entry.frames, corpus.fps), model.style(style)
        if contacts:
            weights = model.curves(heard(name), chosen, span, blinks=False).select(names).values
        else:
            weights = model.weights(heard(name), chosen, span)
        return Track(weights, corpus.template(entry.subject), corpus.fps, basis)

    return predict


def true_track(corpus: Corpus, name: str) -> Track:
    """A clip as it was recorded. Raises CorpusError for a clip that is not there."""
    subject = corpus.entry(name).subject
    return Track(corpus.frames(name), corpus.template(subject), corpus.fps, corpus.basis)


def _basis_for(names: tuple[str, ...], basis: Array | None, corpus: Corpus) -> Array:
    """(component, vertex, 3) m of a model's weights. Raises ModelError."""
    if basis is None:
        if corpus.basis is not None and set(names) <= set(corpus.components):
            return corpus.basis[[corpus.components.index(name) for name in names]]
        basis = basis_of(names, None)
    if basis.shape[1] != corpus.vertex_count:
        raise ModelError.about(
            corpus.folder,
            found=f"{corpus.vertex_count} vertices",
            allowed=f"{basis.shape[1]}, the topology that the model moves",
        )
    return basis
