"""What a trained VOCA errs by in its own styles, told in its file for `elocute style fit`."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

from elocute.corpus.corpus_store import Corpus
from elocute.models.feature_extraction import extract_features
from elocute.models.style_errors import measure_style_errors
from elocute.models.style_targets import ObservedMotion
from elocute.models.voca import VocaModel
from elocute.motion.vertex_motion import VertexMotion
from elocute.training.onnx_export import add_to_record

CLIPS_MOST = 12  # of each style, evenly spaced


def record_style_errors(path: str | Path, corpus: Corpus, split: str = "default") -> None:
    """Measure a model on clips that it was trained on, and write its errors into its file.

    Parameters
    ----------
    path : str or Path
        The model (.onnx), which is replaced.
    corpus : Corpus
        What it was trained on.
    split : str
        Name of the split.

    Raises
    ------
    ModelError
        Where no clip is in a style of the model.
    OutputError
        Where the file cannot be written.
    """
    model = VocaModel(path)
    errors = measure_style_errors(model, _takes(model, corpus, split))
    add_to_record(path, style_errors=errors.record())


def _takes(model: VocaModel, corpus: Corpus, split: str) -> Iterator[tuple[str, ObservedMotion]]:
    train = corpus.split(split).train
    for style in model.styles:
        names = [name for name in train if corpus.entry(name).subject == style]
        step = -(-len(names) // CLIPS_MOST) or 1
        for name in names[::step]:
            speech, _ = extract_features(model, corpus.sound(name))
            template = corpus.template(style)
            frames = corpus.frames(name)
            yield (
                style,
                ObservedMotion(speech, VertexMotion(frames, template, corpus.fps, corpus.basis)),
            )
