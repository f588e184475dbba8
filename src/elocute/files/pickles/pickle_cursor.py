"""The bytes of a pickle, opcode by opcode; nothing is taken before it is known to be there.

What `pickletools.genops` does, with two differences: long strings stay where they are in the
file (`RawString`), and every promise of a length is compared with what the file still has.
"""

from __future__ import annotations

import codecs
import pickletools
import re
import struct
from collections.abc import Callable
from typing import Any

import numpy as np

from elocute.files.pickles.pickle_budget import MemoryBudget, RefusedError

SHORT = 255  # strings up to here are decoded at once: names, not data
INTEGER_MAX_BYTES = 32
WHOLE = "a whole pickle"  # what is allowed where a file is cut, damaged or something else
DECIMAL_MAX_CHARACTERS = 80
NAME_MAX_BYTES = 1000
_NOT_AN_ESCAPE = re.compile(rb"\\(?![nrt'\"]|x[0-9a-fA-F]{2})")


class RawString:
    """A long string as it lies in the file: text of Python 2 (Latin-1), or bytes."""

    __slots__ = ("_value", "is_text", "view")

    def __init__(self, view: memoryview, is_text: bool) -> None:
        self.view, self.is_text = view, is_text
        self._value: str | bytes | None = None

    def value(self, budget: MemoryBudget) -> str | bytes:
        """The string as a Python value; made once, so that no file can ask for it often."""
        if self._value is None:
            budget.spend(len(self.view))
            self._value = str(self.view, "latin-1") if self.is_text else self.view.tobytes()
        return self._value


class Cursor:
    """Reads opcodes and their arguments from `data`; copies are charged to `budget`."""

    def __init__(self, data: bytes, budget: MemoryBudget | None = None) -> None:
        self._budget = budget or MemoryBudget(len(data))
        self._data, self._view, self._place = data, memoryview(data), 0
        self._opcode = ""

    def opcode(self) -> str:
        """The name of the next opcode, as `pickletools` calls it."""
        place, self._opcode = self._place, "pickle"
        code = self.take(1)[0]
        if code not in _NAMES:
            raise RefusedError(f"byte {code} at {place}, which is no opcode", WHOLE)
        self._opcode = _NAMES[code]
        return self._opcode

    def argument(self) -> Any:
        """What follows the opcode just read; None where nothing does."""
        kind = _KINDS[self._opcode]
        return _READERS[kind](self) if kind else None

    def take(self, count: int) -> memoryview:
        """The next `count` bytes. Raises RefusedError where the file has fewer."""
        left = len(self._data) - self._place
        if not 0 <= count <= left:
            raise RefusedError(
                f"an unfinished {self._opcode} at byte {self._place}: {count} bytes promised, "
                f"{left} left",
                WHOLE,
            )
        self._place += count
        return self._view[self._place - count : self._place]

    def line(self) -> bytes:
        """Up to the next line end, which is left out."""
        end = self._data.find(b"\n", self._place)
        if end < 0:
            raise RefusedError(f"an unfinished {self._opcode} at byte {self._place}", WHOLE)
        line = self._data[self._place : end]
        self._place = end + 1
        return line

    def unsigned(self, size: int) -> int:
        """An unsigned integer of `size` bytes."""
        return int.from_bytes(self.take(size), "little")

    def signed(self, size: int) -> int:
        """A signed integer of `size` bytes."""
        if size > INTEGER_MAX_BYTES:
            raise RefusedError(f"an integer of {size} bytes", f"up to {INTEGER_MAX_BYTES}")
        return int.from_bytes(self.take(size), "little", signed=True)

    def frame(self) -> int:
        """The length of a frame; frames are not buffered here, but must be there."""
        size = self.unsigned(8)
        if size > len(self._data) - self._place:
            raise RefusedError(f"a frame of {size} bytes at {self._place}", WHOLE)
        return size

    def string(self, size: int, is_text: bool) -> str | bytes | RawString:
        """The next `size` bytes as text or bytes, a RawString where they are many."""
        return _string(self.take(size), is_text)

    def unicode(self, size: int) -> str:
        """The next `size` bytes, UTF-8, as text."""
        view = self.take(size)
        self._budget.spend(_text_bytes(view))
        return _decoded(view, "utf-8")

    def quoted(self) -> str | bytes | RawString:
        """A string as Python 2 writes it in its source, quotes and all."""
        line = self.line().strip()
        self._budget.spend(len(line))
        if len(line) < 2 or line[:1] not in (b"'", b'"') or line[:1] != line[-1:]:
            raise RefusedError("a string without quotes", WHOLE)
        # A pair of backslashes is one; written as \x5c, every backslash left begins an escape.
        body = line[1:-1].replace(b"\\\\", b"\\x5c")
        if _NOT_AN_ESCAPE.search(body):
            raise RefusedError("a string with an unknown escape", WHOLE)
        return _string(memoryview(codecs.escape_decode(body)[0]), True)

    def decimal(self) -> int:
        """A whole number in a line of digits."""
        line = self.line()
        digits = line.removesuffix(b"L")
        if len(line) > DECIMAL_MAX_CHARACTERS or not re.fullmatch(rb"-?[0-9]+", digits):
            raise RefusedError(f"no whole number: {printable_start(line)}", WHOLE)
        return int(digits)

    def decimal_or_bool(self) -> int | bool:
        """Protocol 0 writes False and True as 00 and 01."""
        if self._data[self._place : self._place + 3] in (b"00\n", b"01\n"):
            return self.line() == b"01"
        return self.decimal()

    def decimal_fraction(self) -> float:
        """A number in a line."""
        line = self.line()
        try:
            if len(line) > DECIMAL_MAX_CHARACTERS:
                raise ValueError
            return float(line)
        except ValueError:
            raise RefusedError(f"no number: {printable_start(line)}", WHOLE) from None

    def raw_unicode(self) -> str:
        """Text in a line with Python's escapes."""
        line = self.line()
        self._budget.spend(4 * len(line))
        try:
            return line.decode("raw-unicode-escape")
        except UnicodeDecodeError as error:
            raise RefusedError("text with an unknown escape", WHOLE) from error

    def name(self) -> str:
        """A name in a line."""
        line = self.line()
        if len(line) > NAME_MAX_BYTES:
            raise RefusedError(f"a name of {len(line)} bytes", f"up to {NAME_MAX_BYTES}")
        return _decoded(line, "utf-8")


def printable_start(text: str | bytes) -> str:
    """The start of something found, short and printable."""
    start = text[:80]
    plain = (
        (start.decode("latin-1") if isinstance(start, bytes) else start)
        .encode("unicode_escape")
        .decode("ascii")
    )
    return plain if len(text) <= 80 else plain + "…"


def _string(view: memoryview, is_text: bool) -> str | bytes | RawString:
    """Short text or bytes as they are, long ones as a RawString."""
    if len(view) > SHORT:
        return RawString(view, is_text)
    return str(view, "latin-1") if is_text else view.tobytes()


def _decoded(data: bytes | memoryview, encoding: str) -> str:
    """Text; raises RefusedError for bytes of another encoding."""
    try:
        return str(data, encoding, "surrogatepass")
    except UnicodeDecodeError as error:
        raise RefusedError(f"text that is not {encoding}", WHOLE) from error


def _text_bytes(view: memoryview) -> int:
    """Bytes that UTF-8 text takes in Python: one, two or four for every character."""
    top = int(np.frombuffer(view, np.uint8).max(initial=0))
    return len(view) * (1 if top < 0xC4 else 2 if top < 0xF0 else 4)


# Argument kinds in the words of pickletools.
_READERS: dict[str, Callable[[Cursor], Any]] = {
    "uint1": lambda c: c.unsigned(1),
    "uint2": lambda c: c.unsigned(2),
    "uint4": lambda c: c.unsigned(4),
    "uint8": Cursor.frame,
    "int4": lambda c: c.signed(4),
    "long1": lambda c: c.signed(c.unsigned(1)),
    "long4": lambda c: c.signed(c.unsigned(4)),
    "float8": lambda c: struct.unpack(">d", c.take(8))[0],
    "string1": lambda c: c.string(c.unsigned(1), True),
    "string4": lambda c: c.string(c.signed(4), True),
    "bytes1": lambda c: c.string(c.unsigned(1), False),
    "bytes4": lambda c: c.string(c.unsigned(4), False),
    "bytes8": lambda c: c.string(c.unsigned(8), False),
    "bytearray8": lambda c: c.string(c.unsigned(8), False),
    "unicodestring1": lambda c: c.unicode(c.unsigned(1)),
    "unicodestring4": lambda c: c.unicode(c.unsigned(4)),
    "unicodestring8": lambda c: c.unicode(c.unsigned(8)),
    "unicodestringnl": Cursor.raw_unicode,
    "stringnl": Cursor.quoted,
    "decimalnl_short": Cursor.decimal_or_bool,
    "decimalnl_long": Cursor.decimal,
    "floatnl": Cursor.decimal_fraction,
    "stringnl_noescape": Cursor.name,
    "stringnl_noescape_pair": lambda c: (c.name(), c.name()),
}
_NAMES = {ord(opcode.code): opcode.name for opcode in pickletools.opcodes}
_KINDS = {opcode.name: opcode.arg.name if opcode.arg else "" for opcode in pickletools.opcodes}
# The one opcode whose decimal is a memo's index, never a truth value.
_KINDS["PUT"] = _KINDS["GET"] = "decimalnl_long"
