"""Speech models by name or file; the only place that tells their kinds apart."""

from __future__ import annotations

import os
from pathlib import Path

from elocute.errors import ModelError
from elocute.files.reading import path_of
from elocute.models import articulation_model, crnn_network, karras, talkers, voca
from elocute.models.articulation_model import ArticulationModel
from elocute.models.crnn import CrnnModel
from elocute.models.karras import KarrasModel
from elocute.models.model_file import check_file, open_session, stored_record
from elocute.models.protocol import SpeechModel
from elocute.models.talkers import TalkersModel
from elocute.models.voca import VocaModel
from elocute.numerics.input_checks import check_kind

DEFAULT_MODEL = talkers.SHIPPED
FILE_KINDS = {
    "crnn": CrnnModel,
    karras.KIND: KarrasModel,
    talkers.KIND: TalkersModel,
}
"""Models by the kind in their file; all others are VOCA's."""


def model_names() -> tuple[str, ...]:
    """The names that `open_model` knows, besides files."""
    return (articulation_model.NAME, talkers.SHIPPED, voca.SHIPPED, crnn_network.SHIPPED)


def open_model(model: str | Path = DEFAULT_MODEL) -> SpeechModel:
    """Open any speech model by its name or file.

    Parameters
    ----------
    model : str or Path
        "articulation", "talkers", "voca" or "crnn", or the file of a trained model (.onnx).

    Returns
    -------
    SpeechModel

    Raises
    ------
    ModelError
        For an unknown name, and a file that is missing, too large or not a model of Elocute.
    """
    check_kind("model", model, str | os.PathLike, "a name or a path", ModelError)
    if not isinstance(model, str):
        model = path_of(model, ModelError)
    if str(model) == articulation_model.NAME:
        return ArticulationModel()
    if str(model) == talkers.SHIPPED:
        return TalkersModel(model)
    if str(model) == voca.SHIPPED:
        return VocaModel(model)
    if str(model) == crnn_network.SHIPPED:
        return CrnnModel(model)
    path = Path(model)
    if path.suffix.lower() != ".onnx":
        raise ModelError.about(
            f"model {str(model)!r}",
            found="unknown",
            allowed=f"{', '.join(model_names())}, or a trained model (.onnx)",
        )
    check_file(path, "make one: elocute train voca, train karras or train crnn")
    session = open_session(path)
    kind = FILE_KINDS.get(str(stored_record(session).get("kind")), VocaModel)
    return kind(path, session)
