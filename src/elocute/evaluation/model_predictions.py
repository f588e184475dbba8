"""A model's motion for the clips of a corpus, frame for frame, as evaluations compare it."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

from elocute.array_types import Float32Array
from elocute.corpus.corpus_store import Corpus
from elocute.errors import ModelError
from elocute.head.builtin import load_builtin_head
from elocute.models.feature_extraction import extract_features
from elocute.models.model_shapes import basis_of
from elocute.models.protocol import FrameSpan, SpeechFeatures, SpeechModel
from elocute.motion.vertex_motion import VertexMotion

CACHED_CLIPS = 2  # so that the features of a clip are computed once for all styles


def clip_predictor(
    model: SpeechModel, corpus: Corpus, *, contacts: bool = False, outputs: bool = True
) -> Callable[[str, str], VertexMotion]:
    """Make a function that predicts the motion of a corpus's clips.

    Weights of shapes of the built-in head are
    within 0 to 1, as `animate` gives them.

    Parameters
    ----------
    model : SpeechModel
        The model.
    corpus : Corpus
        The clips.
    contacts : bool
        Whether rests and closures are laid over as `animate` does, for models that move the
        built-in head; otherwise it is the bare output, of a network and of the rules alike.
    outputs : bool
        Whether a mix of styles is one of outputs, as `SpeechModel.style` takes it.

    Returns
    -------
    callable
        Takes a clip's name and a style, and gives a VertexMotion of the clip's length over its
        subject's neutral face.

    Raises
    ------
    ModelError
        Before any sound is read, where the corpus has another topology or the model makes no
        contacts.
    """
    if contacts and not model.makes_contacts:
        raise ModelError.about(
            f"model {model.name}",
            found="one that moves by its own basis",
            allowed="contacts for models that move the built-in head",
        )
    # Shapes of the built-in head, or the model's own basis.
    shown = contacts or model.basis is None
    names = model.components or load_builtin_head().expression_names
    basis = _basis_for(names if shown else (), None if shown else model.basis, corpus)

    @lru_cache(CACHED_CLIPS)
    def features(name: str) -> SpeechFeatures:
        return extract_features(model, corpus.sound(name), contacts=contacts)[0]

    def predict(name: str, style: str) -> VertexMotion:
        entry = corpus.entry(name)
        span = FrameSpan.whole(entry.frames, corpus.fps)
        chosen = model.style(style, outputs=outputs)
        if shown:
            curves = model.curves(features(name), chosen, span, contacts=contacts)
            weights = curves.select(names).values
        else:
            weights = model.weights(features(name), chosen, span)
        return VertexMotion(weights, corpus.template(entry.subject), corpus.fps, basis)

    return predict


def recorded_motion(corpus: Corpus, name: str) -> VertexMotion:
    """A clip as it was recorded.

    Parameters
    ----------
    corpus : Corpus
        The corpus.
    name : str
        A clip of it.

    Returns
    -------
    VertexMotion
        Over the subject's neutral face; frames are read when they are asked for.

    Raises
    ------
    CorpusError
        For an unknown clip.
    """
    subject = corpus.entry(name).subject
    return VertexMotion(corpus.frames(name), corpus.template(subject), corpus.fps, corpus.basis)


def _basis_for(names: tuple[str, ...], basis: Float32Array | None, corpus: Corpus) -> Float32Array:
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
