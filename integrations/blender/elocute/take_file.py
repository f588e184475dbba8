# SPDX-FileCopyrightText: 2026 Elocute contributors
# SPDX-License-Identifier: GPL-3.0-or-later

"""Reads a take out of a .glb that `elocute animate --head` wrote: curves, frame by frame."""

from __future__ import annotations

import array
import json
import struct
import sys
from dataclasses import dataclass, field
from typing import Any

FLOAT, WIDTHS = 5126, {"SCALAR": 1, "VEC3": 3, "VEC4": 4}


@dataclass
class Take:
    """What moves, by the names of nodes."""

    times_s: list[float]
    # by node: the weights of its shapes by name, one a frame
    shapes: dict[str, dict[str, list[float]]] = field(default_factory=dict)
    # by node: its turn from rest, (w, x, y, z) a frame, in its own axes
    turns: dict[str, list[tuple[float, float, float, float]]] = field(default_factory=dict)
    driven: set[str] = field(default_factory=set)  # shapes that the take is in charge of


def read_take(data: bytes, name: str) -> Take:
    """The animation of a name. Raises ValueError for another file."""
    try:
        record, binary = _chunks(data)
        found = [each for each in record["animations"] if each.get("name") == name]
        return _take(record, binary, found[-1])
    except (ValueError, LookupError, TypeError, struct.error) as problem:
        raise ValueError(f"no take {name!r} in the file that elocute wrote") from problem


def _chunks(data: bytes) -> tuple[dict[str, Any], bytes]:
    if data[:4] != b"glTF":
        raise ValueError("another file")
    (length,) = struct.unpack_from("<I", data, 12)
    record = json.loads(data[20 : 20 + length])
    start = 20 + length
    if start >= len(data):
        return record, b""
    (size,) = struct.unpack_from("<I", data, start)
    return record, data[start + 8 : start + 8 + size]


def _take(record: dict[str, Any], binary: bytes, animation: dict[str, Any]) -> Take:
    def values(accessor: int) -> list[float]:
        each = record["accessors"][accessor]
        if each["componentType"] != FLOAT:
            raise ValueError("numbers of another kind")
        view = record["bufferViews"][each["bufferView"]]
        start = view.get("byteOffset", 0) + each.get("byteOffset", 0)
        numbers = array.array("f", binary[start : start + 4 * each["count"] * WIDTHS[each["type"]]])
        if sys.byteorder == "big":
            numbers.byteswap()
        return numbers.tolist()

    samplers = animation["samplers"]
    take = Take(values(samplers[0]["input"]))
    told = animation.get("extras", {}).get("elocute", {})
    take.driven.update(told.get("controls", ()))
    frames = len(take.times_s)
    for channel in animation["channels"]:
        target = channel["target"]
        node = record["nodes"][target["node"]]
        rows = values(samplers[channel["sampler"]]["output"])
        if target["path"] == "weights":
            mesh = record["meshes"][node["mesh"]]
            names = mesh["extras"]["targetNames"]
            take.shapes[node["name"]] = {
                shape: rows[place :: len(names)] for place, shape in enumerate(names)
            }
        elif target["path"] == "rotation":
            rest = node.get("rotation", [0.0, 0.0, 0.0, 1.0])
            take.turns[node["name"]] = [
                from_rest(rest, rows[4 * frame : 4 * frame + 4]) for frame in range(frames)
            ]
    return take


def from_rest(rest: list[float], turned: list[float]) -> tuple[float, float, float, float]:
    """The turn (w, x, y, z) that takes a rest (x, y, z, w) to a turn in the same axes."""
    x, y, z, w = (-rest[0], -rest[1], -rest[2], rest[3])
    a, b, c, d = turned
    return (
        w * d - x * a - y * b - z * c,
        w * a + x * d + y * c - z * b,
        w * b - x * c + y * d + z * a,
        w * c + x * b - y * a + z * d,
    )
