"""A whole training in one call: shards in, crnn.onnx out."""

from __future__ import annotations

from pathlib import Path

from elocute.corpus.shards import Shards
from elocute.training.crnn.config import CrnnTrainConfig
from elocute.training.crnn.export import export_crnn
from elocute.training.crnn.fit import Report, TrainedCrnn, fit, lesson_of
from elocute.training.crnn.training_data import hear_shards
from elocute.training.device import resolve_device

MODEL = "model.onnx"


def train_crnn(
    shards: Shards,
    config: CrnnTrainConfig,
    folder: Path,
    *,
    resume: bool = False,
    report: Report | None = None,
    note: str = "",
    device: str = "auto",
) -> tuple[TrainedCrnn, tuple[tuple[str, str], ...]]:
    """Hear the shards, train, and leave model.onnx, checkpoint, log and events in `folder`.

    Gives the training and the clips that could not be heard, with the reason. Raises CorpusError
    for shards that cannot be learned from, ModelError for settings that do not fit a checkpoint
    and for a device that is not there (see `resolve_device`).
    """
    resolve_device(device)  # before the shards are heard

    def hearing(share: float) -> None:
        if report:
            report(0.0, f"hearing the shards: {share:.0%}")

    basis = shards.basis
    heard = hear_shards(shards, folder, config.fps, hearing)
    lesson = lesson_of(
        heard, basis.head.expression_basis, heard.chosen("train"), heard.chosen("validation")
    )
    trained = fit(lesson, config, folder, resume=resume, report=report, device=device)
    export_crnn(trained, basis, folder / MODEL, note or shards.note)
    return trained, heard.missing
