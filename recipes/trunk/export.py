"""The trunk and its heads as an ONNX graph that goes on where it stopped.

One run takes some rows of sound and what the last run left. Every layer is late by the rows it
sees ahead, so nothing is computed twice. Products are of eight by seven bits, so that no
processor's sums overflow; the scale of each product's rows is what real speech was seen to need
(`scales`).
"""

from __future__ import annotations

import json
from collections.abc import Callable, Iterable
from pathlib import Path
from typing import Any, cast

import numpy as np
import onnx
import torch
from onnx import TensorProto, helper, numpy_helper
from torch import Tensor, nn

from recipes.trunk.network import CausalHead, Trunk, TrunkConfig

OPERATOR_SET = 20
WEIGHT_MOST = 63  # seven bits: two products of eight by seven may be added up in sixteen
ROW_MOST, ROW_MIDDLE = 127, 128
AHEAD = 4  # rows that a layer sees ahead while scales are found
KEPT = 0.99995  # share of the values of real speech that are not clipped


class _Graph:
    """Nodes and weights, written one after another."""

    def __init__(self, most: dict[str, float]) -> None:
        self.most = most
        self.nodes: list[Any] = []
        self.weights: dict[str, np.ndarray] = {}

    def add(self, operation: str, *inputs: str, outputs: int = 1, **attributes: Any) -> Any:
        """A node; returns the names of its outputs."""
        names = [f"v{len(self.nodes)}_{place}" for place in range(outputs)]
        self.nodes.append(helper.make_node(operation, inputs, names, **attributes))
        return names[0] if outputs == 1 else names

    def constant(self, values: Any, kind: Any = np.float32) -> str:
        """An array of the graph; the same one for the same values."""
        array = np.asarray(values, kind)
        for name, held in self.weights.items():
            if held.dtype == array.dtype and held.shape == array.shape and (held == array).all():
                return name
        name = f"w{len(self.weights)}"
        self.weights[name] = array
        return name

    def slice(self, x: str, first: Any, stop: Any, step: int = 1, axis: int = 0) -> str:
        """Part of an axis; ends are numbers or names."""
        ends = [e if isinstance(e, str) else self.constant([e], np.int64) for e in (first, stop)]
        return self.add(
            "Slice", x, *ends, self.constant([axis], np.int64), self.constant([step], np.int64)
        )

    def linear(self, x: str, place: str, layer: nn.Linear) -> str:
        """A layer of the network on rows."""
        return self.product(x, place, layer.weight, layer.bias)

    def product(self, x: str, place: str, weight: Tensor, bias: Tensor) -> str:
        """(row, in) to (row, out); `place` names the scale of the rows."""
        matrix = weight.detach().numpy().T.astype(np.float32)
        scale = np.abs(matrix).max(axis=0) / WEIGHT_MOST + 1e-12
        stored, unit = f"weight_{place}", np.float32(self.most[place] / ROW_MOST)
        self.weights[stored] = np.round(matrix / scale).astype(np.int8)
        middle = self.constant(ROW_MIDDLE, np.uint8)
        rounded = self.add("QuantizeLinear", x, self.constant(unit), middle)
        sums = self.add("MatMulInteger", rounded, stored, middle)
        scaled = self.add(
            "Mul", self.add("Cast", sums, to=TensorProto.FLOAT), self.constant(scale * unit)
        )
        return self.add("Add", scaled, self.constant(bias.detach().numpy()))

    def norm(self, x: str, weight: np.ndarray, bias: np.ndarray) -> str:
        return self.add(
            "LayerNormalization", x, self.constant(weight), self.constant(bias), epsilon=1e-5
        )


def _front(graph: _Graph, trunk: Trunk, bands: str) -> str:
    """(2 · row + 3, 80) to (row, width): both convolutions."""
    x = bands
    for name, step in (("first", 1), ("second", 2)):
        convolution = getattr(trunk, name)
        taps = [graph.slice(x, 0, -2, step), graph.slice(x, 1, -1, step),
                graph.slice(x, 2, 2**31, step)]  # fmt: skip
        side_by_side = graph.add("Concat", *taps, axis=1)
        weight = convolution.weight.permute(0, 2, 1).reshape(convolution.out_channels, -1)
        x = graph.add("Gelu", graph.product(side_by_side, name, weight, convolution.bias))
    return x


def _layer(graph: _Graph, layer: Any, x: str, number: int, config: TrunkConfig) -> tuple[str, ...]:
    """(row, width) in and out, the latter late; and what must be kept: rows, keys, values."""
    entered, place = x, f"layers.{number}"
    width, heads = config.width, config.heads
    normed = graph.norm(x, *(p.detach().numpy() for p in layer.attention_norm.parameters()))
    projected = graph.linear(normed, f"{place}.attend", layer.attend)
    query_now, key_now, value_now = graph.add("Split", projected, outputs=3, axis=1, num_outputs=3)
    count = graph.slice(graph.add("Shape", x), 0, 1)
    late = graph.slice(graph.add("Concat", f"rows_{number}", x, axis=0), 0, count)
    query = graph.slice(graph.add("Concat", f"queries_{number}", query_now, axis=0), 0, count)
    blocks = graph.slice(graph.add("Shape", "windows"), 0, 1)
    per_head = graph.constant([-1, heads, width // heads], np.int64)
    shape = graph.add("Concat", blocks, per_head, axis=0)

    def split(rows: str, permutation: list[int]) -> str:
        return graph.add("Transpose", graph.add("Reshape", rows, shape), perm=permutation)

    def window(kept: str, now: str) -> str:
        return graph.add("Gather", graph.add("Concat", kept, now, axis=0), "windows")

    keys = split(window(f"keys_{number}", key_now), [0, 2, 3, 1])
    values = split(window(f"values_{number}", value_now), [0, 2, 1, 3])
    scaled = graph.add("Mul", query, graph.constant((width // heads) ** -0.5))
    scores = graph.add("MatMul", split(scaled, [0, 2, 1, 3]), keys)
    shares = graph.add("Softmax", graph.add("Add", scores, f"seen_{number}"), axis=-1)
    mixed = graph.add("Transpose", graph.add("MatMul", shares, values), perm=[0, 2, 1, 3])
    flat = graph.add("Reshape", mixed, graph.constant([-1, width], np.int64))
    x = graph.add("Add", late, graph.linear(flat, f"{place}.leave", layer.leave))
    normed = graph.norm(x, *(p.detach().numpy() for p in layer.forward_norm.parameters()))
    wide = graph.add("Gelu", graph.linear(normed, f"{place}.widen", layer.widen))
    x = graph.add("Add", x, graph.linear(wide, f"{place}.narrow", layer.narrow))
    return x, entered, query_now, key_now, value_now


def _head(graph: _Graph, head: CausalHead, rows: str, name: str) -> tuple[str, str]:
    """(row, width) to (row, output); and the entered rows, of which the last must be kept."""
    entered = graph.add("Relu", graph.linear(rows, f"{name}.enter", head.enter))
    x = graph.add("Concat", f"{name}_before", entered, axis=0)
    for number, dilation in enumerate(head.dilations):
        layer = cast(nn.Conv1d, head.layers[number])
        assert layer.bias is not None
        taps = [graph.slice(x, tap * dilation, (tap - 2) * dilation or 2**31) for tap in range(3)]
        side_by_side = graph.add("Concat", *taps, axis=1)
        weight = layer.weight.permute(0, 2, 1).reshape(layer.out_channels, -1)
        turned = graph.add(
            "Relu", graph.product(side_by_side, f"{name}.layers.{number}", weight, layer.bias)
        )
        x = graph.add("Add", taps[-1], turned)
    return graph.linear(x, f"{name}.leave", head.leave), entered


@torch.no_grad()
def scales(trunk: Trunk, sounds: Iterable[Tensor]) -> dict[str, float]:
    """The largest value that each product's rows may have, by the products' names.

    Sounds are (1, frame, 80) bands.
    """
    most: dict[str, float] = {}

    def watch(name: str) -> Callable[..., None]:
        def look(_: Any, given: tuple[Tensor, ...]) -> None:
            sizes = given[0].abs().flatten()
            kept = torch.kthvalue(sizes, max(1, round(KEPT * len(sizes)))).values.item()
            most[name] = max(most.get(name, 0.0), kept)

        return look

    kinds = (nn.Linear, nn.Conv1d)
    hooks = [
        module.register_forward_pre_hook(watch(name))
        for name, module in trunk.named_modules()
        if isinstance(module, kinds)
    ]
    for bands in sounds:
        hidden, last = trunk.rows(bands, AHEAD)
        trunk.told(hidden, last)
        trunk.told(hidden, last, live=True)
        trunk.phones(last)
    for hook in hooks:
        hook.remove()
    return most


def export(trunk: Trunk, path: Path, record: dict[str, Any], most: dict[str, float]) -> None:
    """Write the trunk with both heads, and the record of what it is."""
    config, graph = trunk.eval().config, _Graph(most)
    width, hidden = config.width, ""
    x = graph.add("Add", _front(graph, trunk, "bands"), "positions")
    kept: dict[str, str] = {}
    for number, layer in enumerate(trunk.layers):
        names = [f"{part}_{number}_new" for part in ("rows", "queries", "keys", "values")]
        x, *left = _layer(graph, layer, x, number, config)
        kept |= dict(zip(names, left, strict=True))
        if number + 1 == config.mouth_layer:
            hidden = graph.norm(x, np.ones(width), np.zeros(width))
    rows = graph.norm(x, np.ones(width), np.zeros(width))
    kept["last_new"] = rows
    count = graph.slice(graph.add("Shape", rows), 0, 1)
    waited = [
        graph.slice(graph.add("Concat", before, now, axis=0), 0, count)
        for before, now in (("hidden_before", hidden), ("last_before", rows))
    ]
    both = graph.add("Concat", *waited, axis=1)
    mouth, kept["mouth_new"] = _head(graph, trunk.mouth, both, "mouth")
    newest = graph.add("Concat", hidden, rows, axis=1)
    live, kept["live_mouth_new"] = _head(graph, trunk.live_mouth, newest, "live_mouth")
    told, kept["phones_new"] = _head(graph, trunk.phones, rows, "phones")
    phones = graph.add("LogSoftmax", told, axis=-1)
    outputs = {"hidden": hidden, "mouth": mouth, "live_mouth": live, "phones": phones, **kept}
    for name, made in outputs.items():
        graph.nodes.append(helper.make_node("Identity", [made], [name]))

    def declared(name: str, size: int | None) -> Any:
        return helper.make_tensor_value_info(name, TensorProto.FLOAT, [None, size])

    inputs = [declared("bands", config.bands), declared("positions", width)]
    for number in range(config.layers):
        parts = ("rows", "queries", "keys", "values")
        inputs += [declared(f"{part}_{number}", width) for part in parts]
        shape = [None, 1, None, None]
        inputs.append(helper.make_tensor_value_info(f"seen_{number}", TensorProto.FLOAT, shape))
    inputs += [
        helper.make_tensor_value_info("windows", TensorProto.INT64, [None, None]),
        declared("hidden_before", width),
        declared("last_before", width),
        declared("mouth_before", config.mouth_channels),
        declared("live_mouth_before", config.live_channels),
        declared("phones_before", config.phone_channels),
    ]
    model = helper.make_model(
        helper.make_graph(
            graph.nodes,
            "trunk",
            inputs,
            [declared(name, None) for name in outputs],
            [numpy_helper.from_array(values, name) for name, values in graph.weights.items()],
        ),
        opset_imports=[helper.make_opsetid("", OPERATOR_SET)],
        ir_version=9,
    )
    sizes = {
        "width": width,
        "layers": config.layers,
        "mouth_layer": config.mouth_layer,
        "history": config.history,
        "period": config.period,
        "mouth_ahead": config.mouth_ahead,
        "live_late": config.live_late,
        "live_channels": config.live_channels,
        "mouth_channels": config.mouth_channels,
        "phone_channels": config.phone_channels,
        "reach": trunk.mouth.reach,
    }
    helper.set_model_props(model, {"elocute": json.dumps({**record, **sizes})})
    onnx.checker.check_model(model)
    path.write_bytes(model.SerializeToString())
