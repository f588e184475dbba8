"""Write a small ONNX graph without the `onnx` package, which only training installs.

Weights are not written into it: they are declared as kept elsewhere and handed to onnxruntime as
arrays, so half a gigabyte of DeepSpeech is never serialised. Field numbers are those of onnx.proto.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from elocute.errors import ModelError
from elocute.files.onnx_session import load_onnxruntime, session_of
from elocute.files.protobuf import write_message

IR_VERSION = 8  # July 2021; its operator sets go up to 15
OPERATOR_SET = 14
ONNX_TYPES = {"float32": 1, "int64": 7}
ATTRIBUTE_INT, ATTRIBUTE_STRING = 2, 3
KEPT_ELSEWHERE = 1
WRITTEN_MAX_BYTES = 1024  # shapes and limits must stand in the graph, where ONNX infers from them

Attributes = Mapping[str, int | str]


@dataclass(frozen=True)
class Step:
    """One operation of ONNX: named inputs and outputs, and its attributes."""

    operation: str
    inputs: Sequence[str]
    outputs: Sequence[str]
    attributes: Attributes


def step(operation: str, inputs: str, outputs: str, **attributes: int | str) -> Step:
    """A Step from names with spaces between them."""
    return Step(operation, inputs.split(), outputs.split(), attributes)


def write_graph(
    steps: Sequence[Step],
    weights: Mapping[str, NDArray],
    inputs: Mapping[str, int],
    outputs: Mapping[str, int],
) -> bytes:
    """A model whose inputs and outputs are (frame, size) float32, with weights kept elsewhere."""
    graph = write_message(
        *[(1, _node(each)) for each in steps],
        (2, "elocute"),
        *[(5, _declared(name, array)) for name, array in weights.items()],
        *[(11, _frames(name, size)) for name, size in inputs.items()],
        *[(12, _frames(name, size)) for name, size in outputs.items()],
    )
    operators = write_message((1, ""), (2, OPERATOR_SET))
    return write_message((1, IR_VERSION), (2, "elocute"), (7, graph), (8, operators))


class Network:
    """A graph and its weights in onnxruntime: arrays in by name, arrays out.

    onnxruntime points into the weights without owning them, so they are kept here.
    """

    def __init__(self, graph: bytes, weights: Mapping[str, NDArray], threads: int = 1) -> None:
        onnxruntime = load_onnxruntime()
        large = {name: each for name, each in weights.items() if each.nbytes > WRITTEN_MAX_BYTES}
        self._weights = {
            name: onnxruntime.OrtValue.ortvalue_from_numpy(each) for name, each in large.items()
        }
        self._session = session_of(
            graph,
            "network",
            allowed="weights that fit it",
            error=ModelError,
            threads=threads,
            initializers=self._weights,
        )

    def run(self, output: str, **inputs: NDArray[np.float32]) -> NDArray[np.float32]:
        return np.asarray(self._session.run([output], inputs)[0], np.float32)


def _node(each: Step) -> bytes:
    return write_message(
        *[(1, name) for name in each.inputs],
        *[(2, name) for name in each.outputs],
        (4, each.operation),
        *[(5, _attribute(name, value)) for name, value in each.attributes.items()],
    )


def _attribute(name: str, value: int | str) -> bytes:
    if isinstance(value, int):
        return write_message((1, name), (3, value), (20, ATTRIBUTE_INT))
    return write_message((1, name), (4, value), (20, ATTRIBUTE_STRING))


def _declared(name: str, array: NDArray) -> bytes:
    """A TensorProto: a small one whole, a large one without its numbers, which come beside it."""
    head = [*[(1, size) for size in array.shape], (2, ONNX_TYPES[array.dtype.name]), (8, name)]
    if array.nbytes <= WRITTEN_MAX_BYTES:
        return write_message(*head, (9, array.tobytes()))
    place = write_message((1, "location"), (2, "beside"))
    return write_message(*head, (13, place), (14, KEPT_ELSEWHERE))


def _frames(name: str, size: int) -> bytes:
    """A ValueInfoProto: float32 of shape (frame, size)."""
    shape = write_message((1, write_message((2, "frame"))), (1, write_message((1, size))))
    tensor = write_message((1, ONNX_TYPES["float32"]), (2, shape))
    return write_message((1, name), (2, write_message((1, tensor))))
