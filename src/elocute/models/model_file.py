"""ONNX files that Elocute trained: opening them, and what kind they are."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np

from elocute.errors import ModelError
from elocute.files import onnx_session
from elocute.files.json_records import parse_json
from elocute.files.reading import FileKind

FILE_MAX_BYTES = 512_000_000
MODEL_FILE = FileKind("a model that Elocute trained", FILE_MAX_BYTES, ModelError)
RECORD_MAX = 1_000_000


def check_file(path: Path, remedy: str) -> None:
    """Raise ModelError for a file that is missing or too large."""
    if not path.is_file():
        raise ModelError.about(
            path, found="no such file", allowed="a trained model (.onnx)", remedy=remedy
        )
    if path.stat().st_size > FILE_MAX_BYTES:
        raise ModelError.about(path, found="more than 512 MB", allowed="a trained model")


def open_session(path: Path) -> Any:
    """One thread, from bytes, so that a file cannot name other files as its weights.

    Raises ModelError where it is no ONNX network.
    """
    return onnx_session.open_session(path, MODEL_FILE)


def stored_record(session: Any) -> dict[str, Any]:
    """The JSON of the metadata, {} where there is none."""
    try:
        entry = session.get_modelmeta().custom_metadata_map.get("elocute", "")
        record = parse_json(entry[:RECORD_MAX], "record", allowed="JSON", error=ModelError)
    except (ModelError, UnicodeDecodeError):
        return {}
    return record if isinstance(record, dict) else {}


def run_session(session: Any, path: Path, names: list[str], given: dict[str, Any]) -> list[Any]:
    """Run a network on named arrays.

    Raises ModelError for a network of another form, and for NaN or infinity in its outputs, as
    broken weights give.
    """
    try:
        answers = session.run(names, given)
    except Exception as error:  # onnxruntime has no common base of its own
        raise ModelError.about(
            path,
            found="a network with other inputs or outputs",
            allowed="a model that Elocute trained",
        ) from error
    for name, answer in zip(names, answers, strict=True):
        if getattr(answer, "dtype", np.dtype(object)).kind != "f" or np.isfinite(answer).all():
            continue
        raise ModelError.about(
            path,
            found=f"{name} that are NaN or infinity",
            allowed="a model whose weights are finite",
            remedy="train it again, or use another model",
        )
    return answers
