"""What Elocute adds to the ONNX files that it exports."""

from __future__ import annotations

import json
from typing import Any

import numpy as np


def attach_constant(model: Any, name: str, values: np.ndarray) -> None:
    """Put a constant into the graph as a further output."""
    from onnx import TensorProto, helper, numpy_helper

    values = np.ascontiguousarray(values, np.float32)
    model.graph.initializer.append(numpy_helper.from_array(values, f"{name}_values"))
    model.graph.node.append(helper.make_node("Identity", [f"{name}_values"], [name]))
    model.graph.output.append(helper.make_tensor_value_info(name, TensorProto.FLOAT, values.shape))


def attach_record(model: Any, record: dict[str, Any]) -> None:
    """Put what run time must know into the metadata, as JSON."""
    entry = model.metadata_props.add()
    entry.key, entry.value = "elocute", json.dumps(record)
