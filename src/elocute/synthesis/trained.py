"""Any trained model by its name or file: VOCA and the recurrent one, told apart by their record."""

from __future__ import annotations

from pathlib import Path

from elocute.errors import ModelError
from elocute.synthesis import crnn, voca
from elocute.synthesis.crnn import CrnnModel
from elocute.synthesis.trained_file import check_file, open_session, stored_record
from elocute.synthesis.voca import VocaModel

NAMES = (voca.SHIPPED, crnn.SHIPPED)


def is_trained(model: str | Path) -> bool:
    """Whether a trained model is named: one that ships, or a file."""
    return str(model) in NAMES or Path(model).suffix.lower() == ".onnx"


def open_trained(model: str | Path) -> VocaModel | CrnnModel:
    """Raises ModelError where the file is missing, too large or no model of Elocute."""
    if str(model) == voca.SHIPPED:
        return VocaModel(model)
    if str(model) == crnn.SHIPPED:
        if not crnn.SHIPPED_PATH.is_file():
            raise ModelError.about(
                "model crnn", found="its weights are not in this installation",
                allowed="a file of one's own (.onnx)",
                remedy="make one: elocute train crnn SHARDS SOUNDS -o FOLDER",
            )  # fmt: skip
        return CrnnModel(model)
    path = Path(model)
    check_file(path, "make one: elocute train voca, or elocute train crnn")
    session = open_session(path)
    return CrnnModel(path, session) if stored_record(session).get("kind") == "crnn" else (
        VocaModel(path, session)
    )  # fmt: skip
