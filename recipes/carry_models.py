"""Carry the learned models that ship over to a head whose shapes were sculpted anew.

    git show REVISION:src/elocute/head/assets/head.npz > before.npz
    python -m recipes.carry_models before.npz

`voca` and `crnn` learned the curves of the old shapes. What the lips do stays the same where a
curve gives up part of its movement to another: `mouthLowerDown` used to lift the upper lip, too,
and leaves that to `mouthUpperUp` now. Both networks end in a linear map, so the change is exact:
of `voca` the last layer changes, of `crnn` the shapes that its parameters weigh.
"""

from __future__ import annotations

import argparse
import json
from pathlib import Path

import numpy as np
import onnx
from onnx import numpy_helper

from elocute.head import HeadModel, load_builtin_head, load_head
from elocute.numerics.ridge import ridge_projection

ASSETS = Path(__file__).parents[1] / "src" / "elocute" / "models" / "assets"
SIDES = ("Left", "Right")
MARK = "upper_lip"
"""In a model's record: mouthUpperUp alone lifts the upper lip."""


def curve_change(before: HeadModel, after: HeadModel) -> np.ndarray:
    """(new curve, old curve): weights on the new shapes that move the lips as the old ones did."""
    change = np.eye(len(after.expression_names))
    third = len(after.inner_lip_upper) // 3
    upper = after.inner_lip_upper[third:-third]  # what the opening of a mouth is measured by
    for side in SIDES:
        down, up = (
            after.expression_index(f"mouth{name}{side}") for name in ("LowerDown", "UpperUp")
        )
        lost = (before.expression_basis[down] - after.expression_basis[down])[upper, 1].mean()
        change[up, down] = lost / after.expression_basis[up][upper, 1].mean()
    return change


def carry_voca(path: Path, change: np.ndarray) -> None:
    model, record = _opened(path)
    for tensor in model.graph.initializer:
        if tensor.name.startswith("voca.decoder."):
            values = change @ numpy_helper.to_array(tensor)
            tensor.CopyFrom(numpy_helper.from_array(values.astype(np.float32), tensor.name))
    covariance = change @ np.array(record["style_errors"]["covariance"]) @ change.T
    record["style_errors"]["covariance"] = covariance.round(6).tolist()
    _save(path, model, record)


def carry_crnn(path: Path, change: np.ndarray, before: HeadModel, after: HeadModel) -> None:
    model, record = _opened(path)
    tensor = next(each for each in model.graph.initializer if each.name == "basis_values")
    basis = numpy_helper.to_array(tensor)
    rows, old = basis.reshape(len(basis), -1).astype(np.float64), _rows(before)
    weights = rows @ ridge_projection(old)
    print(
        f"{path.name}: {np.abs(weights @ old - rows).max() * 1e6:.1f} µm are no mix of old shapes"
    )
    carried = (weights @ change.T @ _rows(after)).reshape(basis.shape)
    tensor.CopyFrom(numpy_helper.from_array(carried.astype(np.float32), tensor.name))
    _save(path, model, record)


def _rows(head: HeadModel) -> np.ndarray:
    return head.expression_basis.reshape(len(head.expression_basis), -1).astype(np.float64)


def _opened(path: Path) -> tuple[onnx.ModelProto, dict]:
    model = onnx.load(str(path))
    record = json.loads(next(each.value for each in model.metadata_props if each.key == "elocute"))
    if MARK in record:
        raise SystemExit(f"{path}: carried over before; allowed: a file as it was trained")
    return model, record | {MARK: "own"}


def _save(path: Path, model: onnx.ModelProto, record: dict) -> None:
    for each in model.metadata_props:
        if each.key == "elocute":
            each.value = json.dumps(record)
    onnx.save(model, str(path))
    print(path, f"{path.stat().st_size / 1e6:.2f} MB")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("before", type=Path, help="the head that the models were trained with")
    before, after = load_head(parser.parse_args().before), load_builtin_head()
    change = curve_change(before, after)
    carry_voca(ASSETS / "voca.onnx", change)
    carry_crnn(ASSETS / "crnn.onnx", change, before, after)


if __name__ == "__main__":
    main()
