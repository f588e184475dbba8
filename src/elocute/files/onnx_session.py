"""The one way to open an ONNX network: from memory, on few threads, complete in its file."""

from __future__ import annotations

import os
from collections.abc import Iterator
from pathlib import Path
from typing import Any

from elocute.errors import InputError, ModelError
from elocute.files.protobuf import BYTES, VARINT, read_fields
from elocute.files.reading import read_bytes

FIELDS_MAX = 2_000_000
DEPTH_MAX = 64
# onnx.proto: the fields that lead from a ModelProto to every TensorProto.
_INSIDE: dict[str, dict[int, str]] = {
    "model": {7: "graph", 20: "training", 25: "function"},
    "graph": {1: "node", 5: "tensor", 15: "sparse"},
    "training": {1: "graph", 2: "graph"},
    "function": {7: "node", 11: "attribute"},
    "node": {5: "attribute"},
    "attribute": {5: "tensor", 6: "graph", 10: "tensor", 11: "graph", 22: "sparse", 23: "sparse"},
    "sparse": {1: "tensor", 2: "tensor"},
}
_TENSOR_PLACES, _TENSOR_LOCATION = 13, 14


def open_session(
    path: str | Path,
    *,
    max_bytes: int,
    allowed: str,
    error: type[InputError] = ModelError,
    remedy: str = "",
    threads: int = 1,
) -> Any:
    """Open a network whose weights all lie in its file.

    The file is read into memory first, so that it cannot name other files; one that does is
    refused.

    Parameters
    ----------
    path : str or Path
        The file.
    max_bytes : int
        Largest size of the file, bytes.
    allowed, remedy : str
        What kind of file is wanted, and how to get one; both appear in the error message.
    error : type of InputError
        The class to raise.
    threads : int
        Threads of one run.

    Returns
    -------
    onnxruntime.InferenceSession
        On the CPU.

    Raises
    ------
    InputError
        Of the class `error`, for a file that is missing, too large or not a network.
    """
    data = read_bytes(path, max_bytes=max_bytes, allowed=allowed, error=error, remedy=remedy)
    try:
        outside = next(_tensors_elsewhere(memoryview(data), "model", DEPTH_MAX), None)
    except (ValueError, TypeError) as problem:
        raise error.about(path, found=f"no ONNX network ({problem})", allowed=allowed) from None
    if outside is not None:
        raise error.about(path, found="weights kept in other files", allowed=f"{allowed}, complete")
    return session_of(data, path, allowed=allowed, error=error, threads=threads)


def session_of(
    model: bytes,
    subject: str | Path,
    *,
    allowed: str,
    error: type[InputError] = ModelError,
    threads: int = 1,
    initializers: dict[str, Any] | None = None,
) -> Any:
    """Open a network in memory.

    Parameters
    ----------
    model : bytes
        An ONNX model.
    subject : str or Path
        Where it is from, for the message.
    allowed : str
        What is wanted.
    error : type of InputError
        The class to raise.
    threads : int
        Threads of one run.
    initializers : dict of str to onnxruntime.OrtValue, optional
        Weights that the model declares without containing them.

    Returns
    -------
    onnxruntime.InferenceSession
        On the CPU.

    Raises
    ------
    InputError
        Of the class `error`, where onnxruntime does not take the model.
    """
    onnxruntime = load_onnxruntime()
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads, options.inter_op_num_threads = threads, 1
    options.log_severity_level = 4  # our error says in one line what it logs in many
    if initializers:
        options.add_external_initializers(list(initializers), list(initializers.values()))
    try:
        return onnxruntime.InferenceSession(
            model, options, providers=["CPUExecutionProvider"], enable_fallback=0
        )  # a second try, announced on standard output, would fail as the first did
    except Exception as problem:  # onnxruntime has no common base of its own
        raise error.about(subject, found="no ONNX network", allowed=allowed) from problem


def load_onnxruntime() -> Any:
    """Import onnxruntime, told to send nothing.

    Releases from 1.31 on count sessions, keep an identifier below the user's cache folder and send
    both to their maker, from threads of their own that start with the import. They then heed the
    environment; the call is for a program that imported onnxruntime before.

    Returns
    -------
    module
        `onnxruntime`.
    """
    os.environ["ORT_DISABLE_TELEMETRY"] = "1"
    import onnxruntime

    onnxruntime.disable_telemetry_events()
    return onnxruntime


def _tensors_elsewhere(message: memoryview, kind: str, depth: int) -> Iterator[bool]:
    """Something for every tensor of the model whose numbers are kept in another file."""
    if not depth:
        raise ValueError("graphs nested too deeply")
    inside = _INSIDE.get(kind, {})
    for number, wire_type, value in read_fields(message, FIELDS_MAX):
        if kind == "tensor":
            if (number == _TENSOR_LOCATION and wire_type == VARINT and value) or (
                number == _TENSOR_PLACES
            ):
                yield True
        elif number in inside and wire_type == BYTES and isinstance(value, memoryview):
            yield from _tensors_elsewhere(value, inside[number], depth - 1)
