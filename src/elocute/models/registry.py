"""Speech models by name or file; the only place that tells their kinds apart."""

from __future__ import annotations

import importlib
import os
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING

from elocute.errors import ModelError

if TYPE_CHECKING:
    from elocute.models.protocol import SpeechModel


@dataclass(frozen=True)
class BuiltinModel:
    """A model that `open_model` knows by its name.

    Parameters
    ----------
    module, name : str
        The module of this package that has it, and its class; without arguments it opens what is
        shipped.
    about : str
        What it is, in a few words.
    """

    module: str
    name: str
    about: str


MODELS = {
    "articulation": BuiltinModel("articulation_model", "ArticulationModel", "rules alone"),
    "talkers": BuiltinModel("talkers", "TalkersModel", "mouths as learned from people"),
    "voca": BuiltinModel("voca", "VocaModel", "VOCA 2019"),
    "crnn": BuiltinModel("crnn", "CrnnModel", "the recurrent model of 2019"),
}
"""All that is needed to add one."""
DEFAULT_MODEL = "talkers"
FILE_KINDS = {
    "crnn": MODELS["crnn"],
    "karras": BuiltinModel("karras", "KarrasModel", "Karras et al. 2017"),
    "trunk": MODELS["talkers"],
}
"""Models by the kind that their files state; all others are VOCA's."""


def model_names() -> tuple[str, ...]:
    """The names that `open_model` knows, besides files."""
    return tuple(MODELS)


def open_model(model: str | Path = DEFAULT_MODEL) -> SpeechModel:
    """Open any speech model by its name or file.

    Parameters
    ----------
    model : str or Path
        A name of `model_names`, or the file of a trained model (.onnx).

    Returns
    -------
    SpeechModel

    Raises
    ------
    ModelError
        For an unknown name, and a file that is missing, too large or not a model of Elocute.
    """
    # The names above are known before NumPy is.
    from elocute.files.reading import path_of
    from elocute.models.model_file import check_file, open_session, stored_record
    from elocute.numerics.input_checks import check_kind

    check_kind("model", model, str | os.PathLike, "a name or a path", ModelError)
    if not isinstance(model, str):
        model = path_of(model, ModelError)
    if str(model) in MODELS:
        return _class_of(MODELS[str(model)])()
    path = Path(model)
    if path.suffix.lower() != ".onnx":
        raise ModelError.about(
            f"model {str(model)!r}",
            found="unknown",
            allowed=f"{', '.join(MODELS)}, or a trained model (.onnx)",
        )
    check_file(path, "make one: elocute train voca, train karras or train crnn")
    session = open_session(path)
    kind = FILE_KINDS.get(str(stored_record(session).get("kind")), MODELS["voca"])
    return _class_of(kind)(path, session)


def _class_of(model: BuiltinModel) -> type:
    return getattr(importlib.import_module(f"elocute.models.{model.module}"), model.name)
