"""From a torch network to one ONNX file with all that it takes to run it."""

from __future__ import annotations

import io
import json
import warnings
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import numpy as np
import torch
from torch import Tensor, nn

from elocute.corpus.corpus_store import Corpus
from elocute.files.atomic import write_atomically

OPSET = 17

Axes = dict[str, dict[int, str]]
"""Of an input or output by name, its axes of any length by number, each with a name."""


def export_network(
    network: nn.Module,
    inputs: Mapping[str, Tensor],
    outputs: list[str],
    axes: Axes,
    path: str | Path,
    *,
    record: dict[str, Any],
    constants: Mapping[str, np.ndarray],
) -> None:
    """Trace a network on example inputs and write it, whole or not at all.

    constants: further outputs that never change. record: JSON in the file's metadata. Raises
    OutputError.
    """
    import onnx

    traced = io.BytesIO()  # a path would have to be UTF-8
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        torch.onnx.export(
            network.eval(),
            tuple(inputs.values()),
            traced,  # pyright: ignore[reportArgumentType] a file that is open is allowed too
            input_names=list(inputs),
            output_names=outputs,
            opset_version=OPSET,
            dynamo=False,
            dynamic_axes=axes,
        )
    model = onnx.load_model_from_string(traced.getvalue())
    for name, values in constants.items():
        _attach_constant(model, name, values)
    _attach_record(model, record)
    with write_atomically(path) as draft:
        draft.write_bytes(model.SerializeToString())


def corpus_record(
    config: Any, styles: tuple[str, ...], features: int, corpus: Corpus, own_basis: bool, note: str
) -> dict[str, Any]:
    """What the record of every network trained on a corpus ends with.

    config: settings of its training. features: numbers in a row of what it hears. own_basis:
    whether it weighs shapes of its own, not the corpus's.
    """
    return {
        "styles": styles,
        "features": features,
        "components": () if own_basis else corpus.components,
        "topology": corpus.topology,
        "vertices": corpus.vertex_count,
        "config": asdict(config),
        "note": note,
    }


def add_to_record(path: str | Path, **entries: Any) -> None:
    """Add JSON entries to the record of a file that `export_network` wrote, or replace them there.

    Raises OutputError where the file cannot be written.
    """
    import onnx

    model = onnx.load_model_from_string(Path(path).read_bytes())
    (entry,) = (each for each in model.metadata_props if each.key == "elocute")
    entry.value = json.dumps({**json.loads(entry.value), **entries})
    with write_atomically(path) as draft:
        draft.write_bytes(model.SerializeToString())


def _attach_constant(model: Any, name: str, values: np.ndarray) -> None:
    """Add a constant to the graph as a further output."""
    from onnx import TensorProto, helper, numpy_helper

    values = np.ascontiguousarray(values, np.float32)
    model.graph.initializer.append(numpy_helper.from_array(values, f"{name}_values"))
    model.graph.node.append(helper.make_node("Identity", [f"{name}_values"], [name]))
    model.graph.output.append(helper.make_tensor_value_info(name, TensorProto.FLOAT, values.shape))


def _attach_record(model: Any, record: dict[str, Any]) -> None:
    """Add what the runtime must know to the metadata, as JSON."""
    entry = model.metadata_props.add()
    entry.key, entry.value = "elocute", json.dumps(record)
