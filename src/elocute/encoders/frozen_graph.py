"""A frozen TensorFlow graph read as data: its nodes' names and its constant tensors.

Nothing in the graph is executed, and TensorFlow is not needed. Field numbers are those of
graph.proto, node_def.proto, attr_value.proto, tensor.proto and tensor_shape.proto (TensorFlow 1.x).
Sizes that a file declares are checked before memory is taken for them.
"""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.errors import InputError
from elocute.files.protobuf import BYTES, Value, read_fields, read_varints
from elocute.files.reading import FileKind, read_bytes

FILE_MAX_BYTES = 2**31 - 1  # the limit of protocol buffers themselves
NODES_MAX = 20_000  # DeepSpeech has some hundreds
FIELDS_MAX = 2_000  # of one node, or values that stand one by one in a tensor
SPREAD_MAX = 1 << 20  # elements for which one value may stand: a bias, never a matrix
LISTED_MAX_BYTES = 1 << 20  # of whole numbers, each of which is an object while it is read
AXES_MAX = 8
DTYPES = {1: np.dtype("<f4"), 3: np.dtype("<i4")}  # DT_FLOAT, DT_INT32

NODE, NODE_NAME, NODE_OP, NODE_ATTRIBUTE = 1, 1, 2, 5
KEY, VALUE = 1, 2
ATTRIBUTE_TENSOR = 8
TENSOR_DTYPE, TENSOR_SHAPE, TENSOR_CONTENT, TENSOR_FLOATS, TENSOR_INTS = 1, 2, 4, 5, 7
SHAPE_AXIS, AXIS_SIZE = 2, 1


@dataclass(frozen=True, eq=False)
class FrozenGraph:
    """nodes: what each name's operation is, and the bytes of the node."""

    path: Path
    nodes: dict[str, tuple[str, memoryview]]

    def constant(self, name: str) -> NDArray[np.float32] | NDArray[np.int32]:
        """The tensor of a Const node; a read-only view of the file where it can be.

        Raises InputError where there is no such node, or its tensor is not what it declares.
        """
        operation, node = self.nodes.get(name, ("", memoryview(b"")))
        if operation != "Const":
            found = f"node {name!r} is {operation!r}" if operation else f"no node {name!r}"
            raise InputError.about(self.path, found=found, allowed="a Const tensor there")
        try:
            return _tensor(_attribute(node, b"value"))
        except ValueError as error:
            raise InputError.about(self.path, found=f"node {name!r}: {error}") from error


def read_frozen_graph(path: str | Path) -> FrozenGraph:
    """Read a `.pb` file's nodes. Raises InputError for a file that is not a GraphDef."""
    path = Path(path)
    data = read_bytes(path, FileKind("a frozen graph (.pb)", FILE_MAX_BYTES))
    try:
        return FrozenGraph(path, _nodes(memoryview(data)))
    except ValueError as error:
        raise InputError.about(
            path,
            found=f"no whole frozen graph: {error}",
            allowed="a GraphDef in binary form (.pb)",
            remedy="download or copy it again",
        ) from error


def _nodes(graph: memoryview) -> dict[str, tuple[str, memoryview]]:
    nodes: dict[str, tuple[str, memoryview]] = {}
    for number, wire_type, node in read_fields(graph, NODES_MAX):
        if (number, wire_type) != (NODE, BYTES):
            continue
        assert isinstance(node, memoryview)
        fields = _last(node)
        name, operation = _text(fields.get(NODE_NAME)), _text(fields.get(NODE_OP))
        if not name or name in nodes:
            raise ValueError(f"node {name!r} twice" if name else "a node without a name")
        nodes[name] = operation, node
    if not nodes:
        raise ValueError("it has no nodes")
    return nodes


def _last(message: memoryview) -> dict[int, Value]:
    """Each field's last value, which is the one that counts."""
    return {number: value for number, _, value in read_fields(message, FIELDS_MAX)}


def _text(value: Value | None) -> str:
    return str(value, "utf-8", "replace") if isinstance(value, memoryview) else ""


def _attribute(node: memoryview, name: bytes) -> memoryview:
    """The TensorProto of a node's attribute."""
    for number, wire_type, entry in read_fields(node, FIELDS_MAX):
        if (number, wire_type) != (NODE_ATTRIBUTE, BYTES):
            continue
        assert isinstance(entry, memoryview)
        pair = _last(entry)
        key, value = pair.get(KEY), pair.get(VALUE)
        if key == name and isinstance(value, memoryview):
            tensor = _last(value).get(ATTRIBUTE_TENSOR)
            if isinstance(tensor, memoryview):
                return tensor
    raise ValueError("no tensor")


def _tensor(message: memoryview) -> NDArray:
    fields = _last(message)
    code = fields.get(TENSOR_DTYPE)
    dtype = DTYPES.get(code) if isinstance(code, int) else None
    if dtype is None:
        raise ValueError(f"a tensor of type {code}, allowed: float32 and int32")
    shape = _shape(fields.get(TENSOR_SHAPE))
    count = math.prod(shape)
    content = fields.get(TENSOR_CONTENT)
    if isinstance(content, memoryview) and len(content):
        if len(content) != count * dtype.itemsize:
            raise ValueError(f"{len(content)} bytes for a tensor of shape {shape}")
        return np.frombuffer(content, dtype).reshape(shape)
    values = _listed(message, dtype)
    if not 0 < len(values) <= count or (len(values) < count and count > SPREAD_MAX):
        raise ValueError(f"{len(values)} values for a tensor of shape {shape}")
    # TensorFlow lets the last value stand for all that follow.
    return np.pad(values, (0, count - len(values)), "edge").reshape(shape)


def _shape(message: Value | None) -> tuple[int, ...]:
    axes: list[int] = []
    if not isinstance(message, memoryview):  # a scalar
        return ()
    for number, _, axis in read_fields(message, AXES_MAX):
        if number != SHAPE_AXIS or not isinstance(axis, memoryview):
            raise ValueError("a tensor of unknown shape")
        size = _last(axis).get(AXIS_SIZE, 0)
        if not isinstance(size, int) or not 0 < size < 1 << 63:  # above: negative, unknown
            raise ValueError("a tensor with an empty or unknown axis")
        axes.append(size)
    return tuple(axes)


def _listed(message: memoryview, dtype: np.dtype) -> NDArray:
    """(value,) that stand in fields of their own: packed in one or one by one."""
    wanted = TENSOR_FLOATS if dtype.kind == "f" else TENSOR_INTS
    parts = [np.zeros(0, dtype)]
    for number, _, value in read_fields(message, FIELDS_MAX):
        if number != wanted:
            continue
        if not isinstance(value, int) and dtype.kind == "i" and len(value) > LISTED_MAX_BYTES:
            raise ValueError(f"a list of more than {LISTED_MAX_BYTES} bytes of whole numbers")
        if isinstance(value, int) or dtype.kind == "i":
            numbers = [value] if isinstance(value, int) else read_varints(value)
            # Negative numbers are written as 64 bits; the lower half is what int32 holds.
            lower = [number & 0xFFFFFFFF for number in numbers]
            parts.append(np.array(lower, np.uint32).view(np.int32).astype(dtype))
        elif len(value) % dtype.itemsize:
            raise ValueError("a list of numbers cut off")
        else:
            parts.append(np.frombuffer(value, dtype))
    return np.concatenate(parts)
