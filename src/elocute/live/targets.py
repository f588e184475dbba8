"""Targets of live frames by name; each is an encoder of packets and a port."""

from __future__ import annotations

import socket
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from ipaddress import ip_address
from typing import TYPE_CHECKING, Protocol

from elocute.errors import InputError

if TYPE_CHECKING:
    from elocute.live.live_frame import LiveFrame

LOOPBACK = "127.0.0.1"


class Encoder(Protocol):
    """What makes packets of frames."""

    def packets(self, frame: LiveFrame) -> list[bytes]:
        """The packets of a frame, in the order in which they are sent."""
        ...


@dataclass(frozen=True)
class Target:
    """A kind of target: the UDP port on which such programs listen, and who they are in a few
    words.

    `module` is that of this package which has it, `encoder` what in it makes a new encoder.
    """

    module: str
    encoder: str
    port: int
    about: str

    def open_encoder(self) -> Encoder:
        """A new encoder."""
        return getattr(import_module(f"elocute.live.{self.module}"), self.encoder)()


TARGETS: dict[str, Target] = {
    "livelink": Target("live_link_face", "LiveLinkFace", 11111, "Live Link Face: Unreal Engine"),
    "vmc": Target("vmc", "vrm0", 39539, "VMC with the expressions of VRM 0"),
    "vmc-vrm1": Target("vmc", "vrm1", 39539, "VMC with the expressions of VRM 1"),
    "vmc-arkit": Target("vmc", "arkit", 39539, "VMC with ARKit's 52 curves"),
    "ifacialmocap": Target("ifacialmocap", "IFacialMocap", 49983, "iFacialMocap: Blender, Unity"),
    "json": Target("json_lines", "JsonLines", 9871, "JSON of ARKit's curves"),
}
"""All that is needed to add one, beside its module."""


class Output:
    """An encoder and the numeric address and port that its packets go to."""

    def __init__(self, encoder: Encoder, address: tuple[str, int]) -> None:
        self._encoder, self.address = encoder, address
        family = socket.AF_INET6 if ":" in address[0] else socket.AF_INET
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self.failures = 0

    def send(self, frame: LiveFrame) -> None:
        """Send a frame. A receiver that is not there misses it; such packets are counted."""
        for packet in self._encoder.packets(frame):
            try:
                self._socket.sendto(packet, self.address)
            except OSError:
                self.failures += 1

    def close(self) -> None:
        self._socket.close()


def open_outputs(wanted: Sequence[str], *, allow_remote: bool = False) -> list[Output]:
    """Outputs for targets as the command line names them.

    They are NAME, NAME=HOST, NAME=:PORT or NAME=HOST:PORT, with a name of `TARGETS`; other machines
    than this one are allowed by `allow_remote` alone.

    Raises
    ------
    InputError
        For an unknown name, no address, and another machine that was not allowed.
    """
    chosen = [(TARGETS[name], address) for name, address in map(_parsed, wanted)]
    for target, (host, _) in chosen:
        if not allow_remote and not ip_address(host).is_loopback:
            raise InputError.about(
                f"target {host}",
                found=f"another machine for {target.about}",
                allowed="this machine",
                remedy="`allow_remote` sends to others, for all to read on the way",
            )
    return [Output(target.open_encoder(), address) for target, address in chosen]


def _parsed(text: str) -> tuple[str, tuple[str, int]]:
    """The name of a target and its address. Raises InputError."""
    name, _, place = text.partition("=")
    if name not in TARGETS:
        raise InputError.about(f"`to` {text[:60]}", found="unknown", allowed=", ".join(TARGETS))
    host, colon, port = place.rpartition(":") if place.count(":") == 1 else (place, "", "")
    number = TARGETS[name].port
    if colon:
        number = int(port) if port.isascii() and port.isdecimal() and len(port) < 6 else 0
    if not 0 < number < 65536:
        raise InputError.about(f"`to` {text[:60]}", found=f"port {port!r}", allowed="1 to 65535")
    try:
        addresses = socket.getaddrinfo(host or LOOPBACK, number, type=socket.SOCK_DGRAM)
    except (OSError, UnicodeError) as error:
        raise InputError.about(
            f"`to` {text[:60]}", found=f"no address of {host!r} ({error})", allowed="a host"
        ) from error
    return name, (str(addresses[0][4][0]), number)
