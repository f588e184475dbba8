"""Decodes meshopt's compression: attributes, triangles, indices, and the filters after them.

As the glTF extensions EXT_meshopt_compression and KHR_meshopt_compression specify the streams.
"""

from __future__ import annotations

from typing import Any

import numpy as np
from numpy.typing import NDArray

Bytes = NDArray[np.uint8]

GROUP = 16
"""Elements whose deltas are packed together."""
BLOCK_BYTES, BLOCK_ELEMENTS = 8192, 256
WIDTHS_0 = (0, 2, 4, 8)
"""Bits of a delta, by the mode of its group."""
WIDTHS_1 = ((0, 1, 2, 4), (1, 2, 4, 8))
ZEROS, LITERAL = 2, 3
TAIL_BYTES = (32, 24)
FIFO = 16
WHOLE = 0xFFFFFFFF
UNPACKED = {
    1: np.unpackbits(np.arange(256, dtype=np.uint8)[:, None], axis=1, bitorder="little"),
    2: (np.arange(256)[:, None] >> np.array([6, 4, 2, 0]) & 3).astype(np.uint8),
    4: (np.arange(256)[:, None] >> np.array([4, 0]) & 15).astype(np.uint8),
}
"""The deltas in each byte, by their bits."""


def unpacked(data: bytes, *, count: int, stride: int, mode: str, filter: str = "NONE") -> Bytes:
    """Unpack one whole stream.

    Memory is taken for `count` elements of `stride` bytes, so the caller says how many are too
    many. mode: ATTRIBUTES, TRIANGLES or INDICES; filter: NONE, OCTAHEDRAL, QUATERNION, EXPONENTIAL
    or COLOR. Raises ValueError for a stream that is damaged or is not what is told of it.

    Returns
    -------
    (count, stride) uint8
    """
    if mode == "ATTRIBUTES":
        if not (0 < stride <= BLOCK_ELEMENTS and stride % 4 == 0):
            raise ValueError(f"elements of {stride} bytes")
        return _filtered(_attributes(data, count, stride), filter)
    if stride not in (2, 4) or filter != "NONE":
        raise ValueError(f"indices of {stride} bytes, filter {filter}")
    if mode == "TRIANGLES" and count % 3 == 0:
        indices = _triangles(data, count // 3)
    elif mode == "INDICES":
        indices = _indices(data, count)
    else:
        raise ValueError(f"{count} indices of mode {mode}")
    kind = np.dtype("<u2" if stride == 2 else "<u4")
    return np.array(indices, np.uint32).astype(kind).view(np.uint8).reshape(count, stride)


def _attributes(data: bytes, count: int, stride: int) -> Bytes:
    version = data[0] - 0xA0 if data else -1
    if version not in (0, 1):
        raise ValueError("no stream of attributes")
    own = stride + (stride // 4 if version else 0)
    tail = np.frombuffer(data, np.uint8)[-own:]
    end = len(data) - max(own, TAIL_BYTES[version])
    if end < 1:
        raise ValueError("a stream that ends early")
    stream = _Stream(np.frombuffer(data, np.uint8)[:end], 1)
    channels = tail[stride:] if version else np.zeros(stride // 4, np.uint8)
    last = tail[:stride].copy()
    most = min(BLOCK_BYTES // stride & ~(GROUP - 1), BLOCK_ELEMENTS)
    out = np.empty((count, stride), np.uint8)
    for start in range(0, count, most):
        block = out[start : start + most]
        deltas = _block(stream, len(block), stride, version)
        for channel, kind in enumerate(channels):
            place = slice(4 * channel, 4 * channel + 4)
            block[:, place] = _summed(deltas[:, place], last[place], int(kind))
        last = block[-1]
    if stream.at != end:
        raise ValueError("a stream with bytes left over")
    return out


class _Stream:
    """Bytes that are taken one piece after another."""

    def __init__(self, data: Bytes, at: int) -> None:
        self.data, self.at = data, at

    def take(self, count: int) -> Bytes:
        """The next bytes. Raises ValueError past the end."""
        taken = self.data[self.at : self.at + count]
        if len(taken) != count:
            raise ValueError("a stream that ends early")
        self.at += count
        return taken

    def leb(self) -> int:
        """The next number of up to 32 bits, seven to a byte."""
        number = 0
        for shift in range(0, 35, 7):
            byte = int(self.take(1)[0])
            number |= (byte & 127) << shift
            if byte < 128:
                return number & WHOLE
        raise ValueError("a number of more than five bytes")


def _block(stream: _Stream, count: int, stride: int, version: int) -> Bytes:
    """The deltas (count, stride) of one block, as they are stored."""
    groups = -(-count // GROUP)
    deltas = np.empty((stride, groups * GROUP), np.uint8)
    control = stream.take(stride // 4) if version else None
    for byte in range(stride):
        kind = -1 if control is None else int(control[byte // 4]) >> 2 * (byte % 4) & 3
        if kind == ZEROS:
            deltas[byte] = 0
        elif kind == LITERAL:
            deltas[byte, :count] = stream.take(count)
        else:
            deltas[byte] = _groups(stream, groups, WIDTHS_0 if kind < 0 else WIDTHS_1[kind])
    return deltas[:, :count].T


def _groups(stream: _Stream, groups: int, widths: tuple[int, ...]) -> Bytes:
    """The deltas of one byte of a block's elements, sixteen for each group."""
    head = stream.take(-(-groups // 4)).tolist()
    out = np.zeros((groups, GROUP), np.uint8)
    for group in range(groups):
        width = widths[head[group >> 2] >> 2 * (group & 3) & 3]
        if width == 8:
            out[group] = stream.take(GROUP)
        elif width:
            values = UNPACKED[width][stream.take(2 * width)].ravel()
            beyond = values == (1 << width) - 1
            values[beyond] = stream.take(int(np.count_nonzero(beyond)))
            out[group] = values
    return out.ravel()


def _summed(deltas: Bytes, last: Bytes, kind: int) -> Bytes:
    """Deltas (element, 4) after the element before them, by the mode of their channel."""
    mode, turn = kind & 15, kind >> 4
    if mode > 2 or (mode < 2 and turn):
        raise ValueError(f"a channel of mode {kind}")
    if mode == 2:
        whole = np.ascontiguousarray(deltas).view("<u4").ravel()
        # To the right: the specification's turn to the left is the writer's.
        whole = whole >> np.uint32(turn) | whole << np.uint32(32 - turn & 31)
        first = np.ascontiguousarray(last).view("<u4")
        summed = np.bitwise_xor.accumulate(np.concatenate([first, whole]))[1:]
        return summed.astype("<u4")[:, None].view(np.uint8)
    unit = np.dtype("<u2" if mode else "u1")
    parts = np.ascontiguousarray(deltas).view(unit)
    signed = np.where(parts & 1, ~(parts >> 1), parts >> 1).astype(unit)
    first = np.ascontiguousarray(last).view(unit)
    summed = np.cumsum(np.concatenate([first[None], signed]), axis=0, dtype=unit)[1:]
    return np.ascontiguousarray(summed).view(np.uint8)


def _filtered(data: Bytes, name: str) -> Bytes:
    """What the elements stand for. Raises ValueError for a filter that does not fit them."""
    count, stride = data.shape
    if name == "NONE":
        return data
    if name == "EXPONENTIAL":
        packed = data.view("<i4")
        with np.errstate(over="ignore"):
            return np.ldexp((packed << 8 >> 8).astype("<f4"), packed >> 24).view(np.uint8)
    filters = {"OCTAHEDRAL": _octahedral, "QUATERNION": _quaternion, "COLOR": _color}
    if name not in filters or stride not in ((8,) if name == "QUATERNION" else (4, 8)):
        raise ValueError(f"filter {name} of {stride} bytes")
    kind = np.dtype("<i2" if stride == 8 else "i1")
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        return filters[name](data.view(kind)).astype(kind).view(np.uint8).reshape(count, stride)


def _rounded(values: NDArray[Any]) -> NDArray[np.int64]:
    finite = np.nan_to_num(values, posinf=0.0, neginf=0.0)
    return np.trunc(finite + np.copysign(0.5, finite)).astype(np.int64)


def _octahedral(stored: NDArray[Any]) -> NDArray[np.int64]:
    values = stored.astype(np.float64)
    plane = values[:, :2] / values[:, 2:3]
    up = 1 - np.abs(plane).sum(axis=1, keepdims=True)
    plane = plane - np.copysign(np.minimum(up, 0), plane)
    unit = np.concatenate([plane, up], axis=1)
    unit /= np.linalg.norm(unit, axis=1, keepdims=True)
    return np.concatenate([_rounded(np.iinfo(stored.dtype).max * unit), stored[:, 3:]], axis=1)


def _quaternion(stored: NDArray[Any]) -> NDArray[np.int64]:
    one = (stored[:, 3] | 3).astype(np.float64)[:, None]
    three = stored[:, :3] / one / np.sqrt(2)
    largest = np.sqrt(np.maximum(0, 1 - np.square(three).sum(axis=1, keepdims=True)))
    turned = _rounded(32767 * np.concatenate([largest, three], axis=1))
    place = (np.arange(4) + (stored[:, 3:] & 3)) % 4
    out = np.empty_like(turned)
    np.put_along_axis(out, place.astype(np.int64), turned, axis=1)
    return out


def _color(stored: NDArray[Any]) -> NDArray[np.int64]:
    most = 255 if stored.dtype.itemsize == 1 else 65535
    luma, orange, green = (stored[:, place].astype(np.int64) for place in range(3))
    luma, alpha = luma & most, stored[:, 3].astype(np.int64) & most
    bits = np.floor(np.log2(np.maximum(alpha, 1))).astype(np.int64)
    scale = (2 << bits) - 1
    clear = alpha & scale >> 1
    clear = clear << 1 | clear & 1
    parts = np.stack([luma + orange - green, luma + green, luma - orange - green, clear], axis=1)
    return _rounded(parts * (most / scale)[:, None])


def _triangles(data: bytes, count: int) -> list[int]:
    """Three corners for each triangle; -1 is an entry of a queue that was never filled."""
    if len(data) < 17 + count or data[0] != 0xE1:
        raise ValueError("no stream of triangles")
    table = data[-16:]
    stream = _Stream(np.frombuffer(data, np.uint8)[: len(data) - 16], 1 + count)
    edges, vertices = [(-1, -1)] * FIFO, [-1] * FIFO
    edge = vertex = following = last = 0
    out: list[int] = []

    def explicit() -> int:
        nonlocal last
        packed = stream.leb()
        last = last + (~(packed >> 1) if packed & 1 else packed >> 1) & WHOLE
        return last

    def corner(code: int) -> int:
        """A corner of a triangle that stands alone: the next, a known or a told one."""
        nonlocal following
        if code == 0:
            following = following + 1 & WHOLE
            return following - 1 & WHOLE
        return explicit() if code == 15 else vertices[(vertex - code) % FIFO]

    for code in data[1 : 1 + count]:
        high, low = code >> 4, code & 15
        if high < 15:
            a, b = edges[(edge - 1 - high) % FIFO]
            if low == 0:
                c = corner(0)
            elif low < 13:
                c = vertices[(vertex - 1 - low) % FIFO]
            elif low < 15:
                c = last = last + (1 if low == 14 else -1) & WHOLE
            else:
                c = explicit()
            new = ((c, b), (a, c))
            known = () if 0 < low < 13 else (c,)
        else:
            pair = table[low] if low < 14 else int(stream.take(1)[0])
            if low >= 14 and pair == 0:
                following = 0
            a = corner(15 if low == 15 else 0)
            second, third = pair >> 4, pair & 15
            b = corner(second)
            c = corner(third)
            new = ((b, a), (c, b), (a, c))
            fresh = [(a, 0), (b, second), (c, third)]
            known = tuple(corner for corner, kind in fresh if kind in (0, 15))
        out += (a, b, c)
        for each in new:
            edges[edge % FIFO] = each
            edge += 1
        for each in known:
            vertices[vertex % FIFO] = each
            vertex += 1
    if stream.at != len(stream.data) or (out and min(out) < 0):
        raise ValueError("a stream of triangles that does not end where it should")
    return out


def _indices(data: bytes, count: int) -> list[int]:
    if len(data) < 5 + count or data[0] != 0xD1:
        raise ValueError("no stream of indices")
    stream = _Stream(np.frombuffer(data, np.uint8)[: len(data) - 4], 1)
    last, out = [0, 0], []
    for _ in range(count):
        packed = stream.leb()
        step = ~(packed >> 2) if packed & 2 else packed >> 2
        last[packed & 1] = last[packed & 1] + step & WHOLE
        out.append(last[packed & 1])
    if stream.at != len(stream.data):
        raise ValueError("a stream of indices with bytes left over")
    return out
