"""ONNX files that Elocute trained: opening them, and what kind they are."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

from elocute.errors import ModelError

FILE_MAX_BYTES = 512_000_000
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
    import onnxruntime

    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    options.log_severity_level = 3
    try:
        return onnxruntime.InferenceSession(
            path.read_bytes(), options, providers=["CPUExecutionProvider"]
        )
    except Exception as error:  # onnxruntime has no common base of its own
        raise ModelError.about(
            path, found="no ONNX network", allowed="a model that Elocute trained"
        ) from error


def stored_record(session: Any) -> dict[str, Any]:
    """The JSON of the metadata, {} where there is none."""
    entry = session.get_modelmeta().custom_metadata_map.get("elocute", "")
    try:
        record = json.loads(entry[:RECORD_MAX])
    except ValueError:
        return {}
    return record if isinstance(record, dict) else {}
