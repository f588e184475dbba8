"""What is said over the WebSocket of `elocute live`: version 1 of docs/use/live-protocol.md."""

from __future__ import annotations

import json
import re
import struct
from dataclasses import dataclass
from typing import Any

import numpy as np

from elocute.errors import InputError
from elocute.files.json_records import as_record, parse_json
from elocute.head.builtin import load_builtin_head
from elocute.live.json_lines import frame_record
from elocute.live.live_frame import SHAPES, LiveFrame
from elocute.one_line_repr import brief

VERSION = 1
TEXT_MAX = 4_096
"""Letters of a message of JSON."""
MESSAGE_MAX_BYTES = 1 << 20
"""Of a block of sound: three seconds of stereo at 48 kHz, and more."""
CHANNELS_MAX, RATES = 8, (8_000, 192_000)
FACE = re.compile(r"[\w.-]{1,64}")
MAIN_FACE = "main"
FORMATS = ("json", "binary")


@dataclass(frozen=True)
class Watch:
    """How a client wants frames: a format of `FORMATS` and shapes of `SHAPES`."""

    format: str
    shapes: str


@dataclass(frozen=True)
class Hello:
    """The first message of a client; without `watch` it wants no frames."""

    face: str
    token: str
    watch: Watch | None


@dataclass(frozen=True)
class Start:
    """Blocks of sound follow, of whole numbers of 16 bits, at a rate in Hz."""

    rate: int
    channels: int


@dataclass(frozen=True)
class Listen:
    """Whether the sound that follows is a partner's."""

    on: bool


@dataclass(frozen=True)
class Interrupt:
    """What was said but not heard yet is void."""


@dataclass(frozen=True)
class End:
    """The sound ends."""


Control = Start | Listen | Interrupt | End


def read_hello(text: str) -> Hello:
    """The first message. Raises InputError for anything else."""
    record = _record(text, "hello", {"version", "face", "token", "watch"})
    if record.get("version") != VERSION:
        raise _about("`version`", record.get("version"), str(VERSION))
    face, token = record.get("face", MAIN_FACE), record.get("token", "")
    if not isinstance(face, str) or not FACE.fullmatch(face):
        raise _about("`face`", face, "1 to 64 letters, digits, dots, - and _")
    if not isinstance(token, str):
        raise _about("`token`", token, "a text")
    watch = record.get("watch")
    return Hello(face, token, None if watch is None else _watch(watch))


def _watch(watch: Any) -> Watch:
    wanted = as_record(watch, "`watch`", "an object with `format` and `shapes`")
    chosen = Watch(wanted.get("format", "json"), wanted.get("shapes", "arkit"))
    _check_one_of("`format`", chosen.format, FORMATS)
    _check_one_of("`shapes`", chosen.shapes, tuple(SHAPES))
    return chosen


def read_control(text: str) -> Control:
    """A later message. Raises InputError for anything else."""
    record = _record(text, None, {"rate", "channels", "on"})
    kind = record["type"]
    if kind == "start":
        rate, channels = record.get("rate"), record.get("channels", 1)
        return Start(
            _whole("`rate`", rate, *RATES), _whole("`channels`", channels, 1, CHANNELS_MAX)
        )
    if kind == "listen":
        if not isinstance(record.get("on"), bool):
            raise _about("`on`", record.get("on"), "true or false")
        return Listen(record["on"])
    plain: dict[Any, Control] = {"interrupt": Interrupt(), "end": End()}
    if not isinstance(kind, str) or kind not in plain:
        raise _about("`type`", kind, "start, listen, interrupt, end")
    return plain[kind]


def welcome(watch: Watch | None) -> str:
    """The answer to `hello`."""
    if watch is None:
        return message("welcome", version=VERSION)
    curves, joints = SHAPES[watch.shapes].names(), load_builtin_head().joint_names
    return message("welcome", version=VERSION, curves=curves, joints=joints)


def refused(error: InputError) -> str:
    """The answer to what cannot be."""
    return message("error", error="refused", message=str(error))


def message(kind: str, **values: Any) -> str:
    """A message of the server."""
    return json.dumps({"type": kind, **values}, separators=(",", ":"))


def encoded(frame: LiveFrame, watch: Watch) -> str | bytes:
    """A frame as JSON or, little-endian: its number and that of its curves (uint32), its time in s
    (float64), the curves, and a quaternion xyzw for each joint (float32)."""
    curves = SHAPES[watch.shapes].values(frame)
    if watch.format == "json":
        return message("frame", **frame_record(frame, curves))
    begin = struct.pack("<IId", frame.number & 0xFFFFFFFF, len(curves), frame.frame.time_s)
    turns = np.roll(frame.frame.rotations, -1, axis=1)
    values = np.concatenate([np.array(list(curves.values())), turns.ravel()])
    return begin + values.astype("<f4").tobytes()


def _record(text: str, kind: str | None, known: set[str]) -> dict[str, Any]:
    """The fields of a message, whose type is `kind` where that is known."""
    if len(text) > TEXT_MAX:
        raise _about("message", f"{len(text)} letters", f"{TEXT_MAX}")
    record = as_record(parse_json(text, "message", allowed="an object"), "message", "an object")
    if kind is not None and record.get("type") != kind:
        raise _about("`type`", record.get("type"), kind)
    unknown = sorted(record.keys() - known - {"type"})
    if unknown or "type" not in record:
        raise _about("message", unknown[0] if unknown else "no `type`", ", ".join(sorted(known)))
    return record


def _check_one_of(subject: str, value: Any, allowed: tuple[str, ...]) -> None:
    if value not in allowed:
        raise _about(subject, value, ", ".join(allowed))


def _whole(subject: str, value: Any, least: int, most: int) -> int:
    if not isinstance(value, int) or isinstance(value, bool) or not least <= value <= most:
        raise _about(subject, value, f"a whole number from {least} to {most}")
    return value


def _about(subject: str, found: Any, allowed: str) -> InputError:
    return InputError.about(subject, found=brief(found), allowed=allowed)
