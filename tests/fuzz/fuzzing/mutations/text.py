"""Text: CSV, OBJ, headers, options."""

from __future__ import annotations

import re
from random import Random

NUMBERS = (
    "0",
    "-0",
    "-1",
    "1",
    "2",
    "0.5",
    "1e-320",
    "5e-324",
    "1e300",
    "-1e300",
    "1e308",
    "1e400",
    "-1e400",
    "NaN",
    "Infinity",
    "-Infinity",
    "nan",
    "inf",
    "2147483648",
    "-2147483649",
    "4294967296",
    "9223372036854775807",
    "9223372036854775808",
    "18446744073709551616",
    "999999999999999999",
    "1" * 19,
    "9" * 400,
    "-" + "9" * 400,
    "9" * 5000,
    "0." + "1" * 400,
    "0x10",
    "1_000",
    "１２",
    "²",
    "1,5",
    "1e5",
    "+1",
    "--1",
    "1e",
    ".",
    "1e9999999999",
)

WORDS = (
    *NUMBERS,
    "",
    " ",
    '"',
    '""',
    "'",
    ",",
    ";",
    ":",
    "\t",
    "\n",
    "\r",
    "\r\n",
    "\0",
    "\x1a",
    "\ufeff",
    "\u202e",
    "\u2028",
    "../../x",
    "/etc/passwd",
    "/dev/zero",
    "file:///etc/passwd",
    "a" * 5000,
    "%s%n",
    "{}",
    "[]",
    "true",
    "null",
    "é",
    "\U0001f600",
    "=1+1",
    "-",
    "#",
    "{",
    "}",
    "1 2 3",
    "1/1/1",
    "0/0/0",
    "-1//-1",
    "\\",
    "\x0b",
    "\x85",
)

_TOKEN = re.compile(rb"[^\s,;:={}\"<>/]+")


def token(rng: Random, data: bytes) -> bytes:
    tokens = list(_TOKEN.finditer(data, 0, 65536))
    one = rng.choice(tokens)
    word = rng.choice(WORDS).encode()
    if rng.random() < 0.1:
        word = bytes(rng.choice(([0xFF], [0xC3, 0x28], [0xED, 0xA0, 0x80], [0])))
    return data[: one.start()] + word + data[one.end() :]


def lines(rng: Random, data: bytes) -> bytes:
    lines = data.split(b"\n")
    at = rng.randrange(min(len(lines), 200))
    act = rng.randrange(6)
    if act == 0:
        del lines[at]
    elif act == 1:
        lines[at:at] = [lines[at]] * rng.choice((1, 1, 100))
    elif act == 2:
        there = rng.randrange(len(lines))
        lines[at], lines[there] = lines[there], lines[at]
    elif act == 3:
        lines[at] = lines[at] * rng.choice((2, 50))
    elif act == 4:
        lines[at] = b""
    else:
        return rng.choice((b"\r", b"\r\n", b"\n\n", b"\0")).join(lines)
    return b"\n".join(lines)


def encoding(rng: Random, data: bytes) -> bytes:
    text = data.decode("utf-8", "replace")
    code = rng.choice(("utf-16", "utf-16-be", "utf-8-sig", "utf-32", "latin-1"))
    return text.encode(code, "replace")
