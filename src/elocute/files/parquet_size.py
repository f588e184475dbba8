"""What a Parquet file unpacks to, found in its footer and page headers before it is opened.

pyarrow trusts both: run lengths make a billion values of a few bytes, a page may announce more
than the footer does, and a footer that lacks a part ends the process. All of it is Thrift's
compact protocol (its specification; parquet.thrift of the format has the field numbers).
"""

from __future__ import annotations

import os
from collections.abc import Iterator
from typing import Any, BinaryIO

MAGIC = b"PAR1"
FOOTER_MAX_BYTES = 2_000_000
HEADER_MAX_BYTES = 100_000
HEADERS_MAX_BYTES = 4_000_000
"""Of all pages together: Thrift is read field by field."""
PAGES_MAX = 100_000
ITEMS_MAX = 10_000
SCHEMA_MAX = 100
DEPTH_MAX = 16
VALUE_BYTES = 8
"""Charged for each value: a number, and where it stands in its row's list."""

TRUE, FALSE, BYTE, I16, I32, I64, DOUBLE, BINARY, LIST, SET = range(1, 11)
STRUCT = 12
# FileMetaData, RowGroup, ColumnChunk, ColumnMetaData: (field number, kind).
SCHEMA, GROUPS = (2, LIST), (4, LIST)
COLUMNS, OTHER_FILE, CHUNK = (1, LIST), (1, BINARY), (3, STRUCT)
CHUNK_VALUES, CHUNK_SIZE, CHUNK_START, CHUNK_DICTIONARY = (5, I64), (7, I64), (9, I64), (11, I64)
# PageHeader, and the headers of pages inside it.
UNPACKED, PACKED = (2, I32), (3, I32)
DATA_PAGE, DICTIONARY_PAGE, DATA_PAGE_2 = (5, STRUCT), (7, STRUCT), (8, STRUCT)
PAGE_VALUES = (1, I32)
ENCODING = {DATA_PAGE: (2, I32), DATA_PAGE_2: (4, I32)}
# Left out is DELTA_BYTE_ARRAY (7), in which a few bytes repeat all of the text before.
ENCODINGS = {0, 2, 3, 4, 5, 6, 8, 9}

Fields = dict[tuple[int, int], Any]


def unpacked_bytes(file: BinaryIO) -> int:
    """An upper bound of the bytes that all columns of a Parquet file take in memory.

    Raises ValueError for a file that is invalid, not whole, or has a part in another file.
    """
    columns = list(_columns(_footer(file)))
    present = os.fstat(file.fileno()).st_size
    if sum(size for _, size, _ in columns) > present:
        raise ValueError("columns that overlap")
    work = _Work()
    return sum(_column_bytes(file, *place, work) for place in columns)


class _Work:
    """Pages and bytes of their headers that were read so far."""

    pages = header_bytes = 0

    def page(self, header_bytes: int) -> None:
        """Count one more. Raises ValueError for too many."""
        self.pages += 1
        self.header_bytes += header_bytes
        if self.pages > PAGES_MAX or self.header_bytes > HEADERS_MAX_BYTES:
            raise ValueError(f"more than {PAGES_MAX} pages, or {HEADERS_MAX_BYTES} bytes of them")


def _footer(file: BinaryIO) -> Fields:
    """The fields of the footer."""
    end = os.fstat(file.fileno()).st_size
    if end < 12:
        raise ValueError("no Parquet file")
    file.seek(end - 8)
    tail = file.read(8)
    size = int.from_bytes(tail[:4], "little")
    if tail[4:] != MAGIC or size > min(FOOTER_MAX_BYTES, end - 8):
        raise ValueError("no footer of a Parquet file")
    file.seek(end - 8 - size)
    return _struct(memoryview(file.read(size)), 0, DEPTH_MAX)[0]


def _columns(footer: Fields) -> Iterator[tuple[int, int, int]]:
    """(start, size, values) of every column chunk."""
    schema = footer.get(SCHEMA)
    if schema is None or len(schema) > SCHEMA_MAX:
        raise ValueError(f"no schema of up to {SCHEMA_MAX} parts")
    for group in footer.get(GROUPS) or ():
        for column in _fields(group).get(COLUMNS) or ():
            column = _fields(column)
            if column.get(OTHER_FILE):
                raise ValueError("a column in another file")
            chunk = _fields(column.get(CHUNK))
            start, size, values = (
                chunk.get(field) for field in (CHUNK_START, CHUNK_SIZE, CHUNK_VALUES)
            )
            if start is None or size is None or values is None or min(start, size, values) < 0:
                raise ValueError("a column without its place")
            dictionary = chunk.get(CHUNK_DICTIONARY, 0)
            yield (dictionary if 0 < dictionary < start else start), size, values


def _fields(value: Any) -> Fields:
    """The fields of a struct; raises ValueError for anything else."""
    if not isinstance(value, dict):
        raise ValueError("a footer that lacks a part")
    return value


def _column_bytes(file: BinaryIO, start: int, size: int, promised: int, work: _Work) -> int:
    """Bytes of a column chunk of `size` bytes at `start` that promises so many values."""
    at, end, total, seen = start, start + size, 0, 0
    while seen < promised:
        file.seek(at)
        head = memoryview(file.read(min(HEADER_MAX_BYTES, max(end - at, 0))))
        fields, length = _struct(head, 0, DEPTH_MAX)
        work.page(length)
        packed, unpacked = fields.get(PACKED, -1), fields.get(UNPACKED, -1)
        if not 0 <= packed <= end - at - length or unpacked < 0:
            raise ValueError("a page that is not whole")
        values = sum(_page_values(fields, kind) for kind in (DATA_PAGE, DATA_PAGE_2))
        entries = _page_values(fields, DICTIONARY_PAGE)
        total += unpacked + (values + entries) * VALUE_BYTES
        seen += values
        at += length + packed
    return total


def _page_values(fields: Fields, kind: tuple[int, int]) -> int:
    """Number of values of a page of one kind, 0 for another kind."""
    if kind not in fields:
        return 0
    count = fields[kind].get(PAGE_VALUES, -1)
    if count < 0:
        raise ValueError("a page without a number of values")
    if kind in ENCODING and fields[kind].get(ENCODING[kind]) not in ENCODINGS:
        raise ValueError("a page of an encoding that is not read")
    return count


def _struct(data: memoryview, at: int, depth: int) -> tuple[Fields, int]:
    """The fields of a struct by number and kind, and where it ends."""
    if not depth:
        raise ValueError("parts nested too deeply")
    fields: Fields = {}
    number = 0
    while True:
        (head,), at = _taken(data, at, 1)
        if not head:
            return fields, at
        kind, step = head & 15, head >> 4
        if step:
            number += step
        else:
            number, at = _whole(data, at)
        if kind in (TRUE, FALSE):
            continue  # the kind is the value, and none is asked for
        fields[number, kind], at = _value(data, at, kind, depth)


def _value(data: memoryview, at: int, kind: int, depth: int) -> tuple[Any, int]:
    """A value of one kind, and where it ends."""
    if kind in (I16, I32, I64):
        return _whole(data, at)
    if kind in (BYTE, DOUBLE, TRUE, FALSE):
        return _taken(data, at, 8 if kind == DOUBLE else 1)
    if kind == BINARY:
        size, at = _varint(data, at)
        return _taken(data, at, size)
    if kind == STRUCT:
        return _struct(data, at, depth - 1)
    if kind in (LIST, SET):
        return _items(data, at, depth - 1)
    raise ValueError(f"a field of kind {kind}")


def _items(data: memoryview, at: int, depth: int) -> tuple[list[Any], int]:
    """The items of a list, and where it ends."""
    (head,), at = _taken(data, at, 1)
    count, kind = head >> 4, head & 15
    if count == 15:
        count, at = _varint(data, at)
    if count > ITEMS_MAX or not depth:
        raise ValueError("a list of too many parts")
    items = []
    for _ in range(count):
        item, at = _value(data, at, kind, depth)
        items.append(item)
    return items, at


def _taken(data: memoryview, at: int, size: int) -> tuple[memoryview, int]:
    """The next `size` bytes, and where they end."""
    if size > len(data) - at:
        raise ValueError("it ends early")
    return data[at : at + size], at + size


def _whole(data: memoryview, at: int) -> tuple[int, int]:
    """A signed number, its sign in the lowest bit."""
    value, at = _varint(data, at)
    return value >> 1 ^ -(value & 1), at


def _varint(data: memoryview, at: int) -> tuple[int, int]:
    """An unsigned number, seven bits a byte, least first; and where it ends."""
    value = 0
    for place in range(10):
        (byte,), at = _taken(data, at, 1)
        value |= (byte & 127) << (7 * place)
        if byte < 128:
            return value, at
    raise ValueError("a number of more than ten bytes")
