"""What a Parquet file takes is told from its headers, in steps that are counted."""

from __future__ import annotations

from pathlib import Path

import pytest

from elocute.files.parquet_size import unpacked_bytes

I32, I64, LIST, STRUCT = 5, 6, 9, 12


def varint(value: int) -> bytes:
    out = b""
    while value > 127:
        out, value = out + bytes([value & 127 | 128]), value >> 7
    return out + bytes([value])


def number(value: int) -> bytes:
    return varint(value << 1)


def struct(*fields: tuple[int, int, bytes]) -> bytes:
    """A struct of Thrift's compact protocol: (number, kind, content) of each field."""
    out, last = b"", 0
    for field, kind, content in fields:
        out, last = out + bytes([(field - last) << 4 | kind]) + content, field
    return out + b"\0"


def list_of(parts: list[bytes]) -> bytes:
    head = bytes([0xF0 | STRUCT]) + varint(len(parts))
    return head + b"".join(parts)


def page(values: int) -> bytes:
    data = struct((1, I32, number(values)), (2, I32, number(0)))
    return struct((2, I32, number(0)), (3, I32, number(0)), (5, STRUCT, data))


def column(start: int, size: int, values: int) -> bytes:
    chunk = struct((5, I64, number(values)), (7, I64, number(size)), (9, I64, number(start)))
    return struct((3, STRUCT, chunk))


def parquet(path: Path, body: bytes, columns: list[bytes]) -> Path:
    schema, groups = list_of([b"\0"]), list_of([struct((1, LIST, list_of(columns)))])
    footer = struct((2, LIST, schema), (4, LIST, groups))
    path.write_bytes(b"PAR1" + body + footer + len(footer).to_bytes(4, "little") + b"PAR1")
    return path


def told(path: Path) -> int:
    with path.open("rb") as file:
        return unpacked_bytes(file)


def test_pages_are_added_up(tmp_path: Path):
    body = page(3) + page(4)
    assert told(parquet(tmp_path / "a", body, [column(4, len(body), 7)])) == 7 * 8


def test_columns_in_the_same_place_are_refused(tmp_path: Path):
    """A thousand columns would look at the same pages a thousand times."""
    body = page(0) * 1000 + page(1)
    columns = [column(4, len(body), 1)] * 1000
    with pytest.raises(ValueError, match="columns that overlap"):
        told(parquet(tmp_path / "a", body, columns))


def test_pages_are_counted_over_all_columns(tmp_path: Path):
    part = page(0) * 60_000 + page(1)
    columns = [column(4 + at * len(part), len(part), 1) for at in range(2)]
    with pytest.raises(ValueError, match="more than 100000 pages"):
        told(parquet(tmp_path / "a", part * 2, columns))
