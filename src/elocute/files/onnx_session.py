"""The one way to open a network: from memory, on few threads, complete in its own file.

onnxruntime builds and runs whatever a file describes. Here a graph that could go on for ever is
refused, and what all networks of files take while they are built and run is limited.
"""

from __future__ import annotations

import contextlib
import os
from functools import cache
from pathlib import Path
from typing import Any

from elocute.errors import InputError, ModelError
from elocute.files.protobuf import BYTES, VARINT, read_fields
from elocute.files.reading import FileKind, read_bytes

FIELDS_MAX = 2_000_000
NODES_MAX = 10_000
GRAPHS_MAX = 100
DEPTH_MAX = 64
ARENA_BYTES = 600_000_000
"""What all networks of files hold at once: their weights, and what they compute with."""
LOOPS = (b"Loop", b"Scan", b"SequenceMap")
"""They repeat a graph as often as they are told. The networks that are trained here need none."""
STANDARD = (b"", b"ai.onnx")
"""ONNX's own operators; onnxruntime knows others, which are no standard."""
# onnx.proto: the fields that lead from a ModelProto to every node and TensorProto.
_INSIDE: dict[str, dict[int, str]] = {
    "model": {7: "graph", 20: "training", 25: "function"},
    "graph": {1: "node", 5: "tensor", 15: "sparse"},
    "node": {5: "attribute"},
    "attribute": {5: "tensor", 6: "graph", 10: "tensor", 11: "graph", 22: "sparse", 23: "sparse"},
    "sparse": {1: "tensor", 2: "tensor"},
}
_TENSOR_PLACES, _TENSOR_LOCATION = 13, 14
_NODE_OPERATOR, _NODE_DOMAIN = 4, 7


class _RefusedError(Exception):
    """What a network has that none needs; becomes the caller's error with the file's name."""


def open_session(path: str | Path, kind: FileKind) -> Any:
    """Open a network whose weights all lie in its file: an onnxruntime.InferenceSession.

    The file is read into memory first, so that it cannot name other files; one that does is
    refused, and so are loops, functions of the file's own and operators that are not ONNX's. It
    runs on the CPU. Raises the kind's error for a file that is missing, too large or not a network.
    """
    data = read_bytes(path, kind)
    allowed, error = kind.allowed, kind.error
    try:
        _Check().message(memoryview(data), "model", DEPTH_MAX)
    except (ValueError, TypeError) as problem:
        raise error.about(path, found=f"no ONNX network ({problem})", allowed=allowed) from None
    except _RefusedError as problem:
        raise error.about(path, found=str(problem), allowed=f"{allowed}, complete") from None
    return session_of(data, path, allowed=allowed, error=error, limited=True)


def session_of(
    model: bytes,
    subject: str | Path,
    *,
    allowed: str,
    error: type[InputError] = ModelError,
    threads: int = 1,
    initializers: dict[str, Any] | None = None,
    limited: bool = False,
) -> Any:
    """Open a network in memory, from `subject`, on the CPU.

    `initializers` are weights (onnxruntime.OrtValue) that the model declares without containing
    them; `limited` holds it to ARENA_BYTES. Raises `error` where onnxruntime does not take the
    model.
    """
    onnxruntime = load_onnxruntime()
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads, options.inter_op_num_threads = threads, 1
    options.log_severity_level = 4  # our error says in one line what it logs in many
    if limited and _arena():
        options.add_session_config_entry("session.use_env_allocators", "1")
    if initializers:
        options.add_external_initializers(list(initializers), list(initializers.values()))
    try:
        return onnxruntime.InferenceSession(
            model,
            options,
            providers=["CPUExecutionProvider"],
            # A second try, announced on standard output, would fail as the first did.
            enable_fallback=0,
            # What is computed while a network is opened is not taken from the arena.
            disabled_optimizers=["ConstantFolding"] if limited else [],
        )
    except Exception as problem:  # onnxruntime has no common base of its own
        raise error.about(subject, found="no ONNX network", allowed=allowed) from problem


def load_onnxruntime() -> Any:
    """The module onnxruntime, told to send nothing.

    Releases from 1.31 on count sessions, keep an identifier below the user's cache folder and send
    both to their maker, from threads of their own that start with the import. They then heed the
    environment; the call is for a program that imported onnxruntime before.
    """
    os.environ["ORT_DISABLE_TELEMETRY"] = "1"
    import onnxruntime

    onnxruntime.disable_telemetry_events()
    return onnxruntime


@cache
def _arena() -> bool:
    """Make the memory that all limited networks of this process share; whether it could be made.

    It grows by what is asked for, and never beyond ARENA_BYTES.
    """
    onnxruntime = load_onnxruntime()
    place = onnxruntime.OrtMemoryInfo(
        "Cpu",
        onnxruntime.OrtAllocatorType.ORT_ARENA_ALLOCATOR,
        0,
        onnxruntime.OrtMemType.DEFAULT,
    )
    as_requested = {
        "max_mem": ARENA_BYTES,
        "arena_extend_strategy": 1,
        "initial_chunk_size_bytes": 1 << 20,
        "max_dead_bytes_per_chunk": -1,
    }
    with contextlib.suppress(Exception):  # the program that imports this has made one of its own
        onnxruntime.create_and_register_allocator(place, onnxruntime.OrtArenaCfg(as_requested))
        return True
    return False


class _Check:
    """Looks at every node and tensor of a model, and counts them."""

    def __init__(self) -> None:
        self._fields = self._nodes = self._graphs = 0

    def message(self, message: memoryview, kind: str, depth: int) -> None:
        """Raises ValueError for what is no network, _RefusedError for what none needs."""
        if not depth:
            raise ValueError("graphs nested too deeply")
        self._count(kind)
        inside = _INSIDE.get(kind, {})
        for number, wire_type, value in read_fields(message, FIELDS_MAX):
            self._fields += 1
            if self._fields > FIELDS_MAX:
                raise ValueError(f"more than {FIELDS_MAX} fields")
            if kind == "tensor":
                _check_tensor(number, wire_type, value)
            elif wire_type == BYTES and isinstance(value, memoryview):
                if kind == "node":
                    _check_node(number, value)
                if number in inside:
                    self.message(value, inside[number], depth - 1)

    def _count(self, kind: str) -> None:
        self._nodes += kind == "node"
        self._graphs += kind == "graph"
        if self._nodes > NODES_MAX or self._graphs > GRAPHS_MAX:
            raise ValueError(f"more than {NODES_MAX} operators or {GRAPHS_MAX} graphs")
        if kind in ("training", "function"):
            raise _RefusedError(f"a {kind} inside a network")


def _check_tensor(number: int, wire_type: int, value: Any) -> None:
    kept_elsewhere = number == _TENSOR_LOCATION and wire_type == VARINT and value
    if kept_elsewhere or number == _TENSOR_PLACES:
        raise _RefusedError("weights kept in other files")


def _check_node(number: int, value: memoryview) -> None:
    if number == _NODE_OPERATOR and value in LOOPS:
        raise _RefusedError(f"the operator {bytes(value).decode()}, which may never end")
    if number == _NODE_DOMAIN and value not in STANDARD:
        raise _RefusedError("an operator that is none of ONNX's own")
