"""A whole training in one call: corpus folder in, one ONNX file out that needs no torch."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path

import torch
from torch import Tensor, nn

from elocute.corpus.corpus_store import Corpus
from elocute.encoders.registry import resolve_encoder
from elocute.files.work_folder import MODEL
from elocute.models.feature_extraction import extract_features
from elocute.models.style_errors import measure_style_errors
from elocute.models.style_targets import ObservedMotion
from elocute.models.voca import VocaModel
from elocute.motion.vertex_motion import VertexMotion
from elocute.networks.voca import SharedVoca, Voca
from elocute.training.decoder import Embedding, decoder_basis, decoder_to_weights
from elocute.training.device import by_first_process
from elocute.training.epochs import Report, open_folder
from elocute.training.onnx_export import add_to_record, corpus_record, export_network
from elocute.training.voca.fit import TrainedVoca, fit
from elocute.training.voca.settings import VocaTrainConfig
from elocute.training.voca.training_data import prepare


def train_voca(
    corpus: Corpus,
    config: VocaTrainConfig,
    folder: str | Path,
    split: str = "default",
    *,
    resume: bool = False,
    report: Report | None = None,
    note: str = "",
    device: str = "auto",
) -> TrainedVoca:
    """Train VOCA on a corpus and export it.

    Parameters
    ----------
    corpus
        Clips with sound and motion.
    config
        Settings; the encoder is one of them.
    folder
        Where to leave model.onnx, checkpoint.safetensors, log.csv and TensorBoard's events.
    split
        Name of the corpus's split.
    resume
        Resume from the checkpoint in `folder`.
    report
        Called with progress.
    note
        What it was trained on, for the model file; the corpus's note by default.
    device
        As for `resolve_device`.

    Returns
    -------
    TrainedVoca

    Raises
    ------
    CorpusError
        For a corpus that it cannot be trained on.
    ModelError
        Where the checkpoint belongs to other settings, or the device is missing.
    OutputError
        Where a file cannot be written.
    """
    folder = open_folder(folder, device, resume=resume)
    data = prepare(corpus, config, resolve_encoder(config.encoder), split, report)
    trained = fit(data, config, folder, resume=resume, report=report, device=device)

    def export() -> None:
        export_voca(trained, corpus, folder / MODEL, note or corpus.note)
        record_style_errors(folder / MODEL, corpus, split)

    by_first_process(export)
    return trained


def export_voca(trained: TrainedVoca, corpus: Corpus, path: str | Path, note: str = "") -> None:
    """Write a trained VOCA as ONNX, its configuration in the metadata; running it needs no torch.

    A corpus with weights gives weights of the same components; one with vertices gives weights of
    the model's own basis, which the file carries. note: what it was trained on, in words for
    people. Raises OutputError.
    """
    network, basis = _runnable(trained)
    shape = trained.network.config
    features = shape.heard or shape.features
    export_network(
        network,
        {
            "features": torch.zeros(40, features),
            "style": torch.zeros(1, shape.styles),
        },
        ["weights"],
        {"features": {0: "frame"}, "weights": {0: "frame"}},
        path,
        record={
            "kind": "voca",
            "version": 1,
            "encoder": trained.config.encoder,
            "fps": trained.fps,
            **corpus_record(
                trained.config, trained.styles, features, corpus, basis is not None, note
            ),
        },
        constants={} if basis is None else {"basis": basis.numpy()},
    )


def _runnable(trained: TrainedVoca) -> tuple[nn.Module, Tensor | None]:
    """The network that gives weights, and its own basis (component, vertex, 3) m if it has one."""
    network, space = trained.network, trained.space
    if space is not None and space.to_weights is not None:
        return SharedVoca(_folded(network, torch.from_numpy(space.to_weights))), None
    return Embedding(SharedVoca(network)), decoder_basis(network.decoder, space)


def _folded(network: Voca, to_weights: Tensor) -> Voca:
    """The same network decoding to weights of the corpus's components."""
    folded = Voca(replace(network.config, outputs=to_weights.shape[1]))
    decoder = decoder_to_weights(network.decoder, to_weights)
    changed = {f"decoder.{name}": value for name, value in decoder.items()}
    folded.load_state_dict({**network.state_dict(), **changed})
    return folded


CLIPS_MOST = 12  # of each style, evenly spaced


def record_style_errors(path: str | Path, corpus: Corpus, split: str = "default") -> None:
    """Measure a model on clips that it was trained on, and write its errors into its file.

    `elocute style fit` reads them. Raises ModelError where no clip is in a style of the model, and
    OutputError where the file cannot be written.
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
