"""Targets of live frames by name; each is an encoder of packets and a port."""

from __future__ import annotations

import socket
from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from ipaddress import ip_address
from typing import TYPE_CHECKING, Any, Protocol

from elocute.errors import ElocuteError, InputError

if TYPE_CHECKING:
    from elocute.live.live_frame import LiveFrame

LOOPBACK = "127.0.0.1"


class Encoder(Protocol):
    """What makes packets of frames."""

    def packets(self, frame: LiveFrame) -> list[bytes]:
        """The packets of a frame, in the order in which they are sent."""
        ...


class Output(Protocol):
    """Where frames go.

    `address` is what it is told as, `failures` how many packets or frames were lost. With
    `has_clock` its receivers show a frame at its own time; else it is sent when it is to be seen.
    """

    address: str
    has_clock: bool
    failures: int

    def send(self, frame: LiveFrame) -> None:
        """Send a frame, without waiting."""
        ...

    def close(self) -> None:
        """Send nothing more."""
        ...


class UdpOutput:
    """An encoder and the numeric address and port that its packets go to."""

    has_clock = False

    def __init__(self, encoder: Encoder, place: tuple[str, int]) -> None:
        self._encoder, self._place = encoder, place
        family = socket.AF_INET6 if ":" in place[0] else socket.AF_INET
        self._socket = socket.socket(family, socket.SOCK_DGRAM)
        self.address = f"{place[0]}:{place[1]}"
        self.failures = 0

    def send(self, frame: LiveFrame) -> None:
        """Send a frame. A receiver that is not there misses it; such packets are counted."""
        for packet in self._encoder.packets(frame):
            try:
                self._socket.sendto(packet, self._place)
            except OSError:
                self.failures += 1

    def close(self) -> None:
        self._socket.close()


@dataclass(frozen=True)
class Access:
    """Who may connect to what this process opens, and where it may send.

    Parameters
    ----------
    allow_remote : bool
        Whether other machines are sent to, and let in.
    token : str
        What who connects has to know; "" is nothing.
    origins : tuple of str
        Web pages of other servers that are let in, "http://localhost:5173".
    """

    allow_remote: bool = False
    token: str = ""
    origins: tuple[str, ...] = ()


@dataclass(frozen=True)
class Target:
    """A kind of target: the port on which such programs listen, and who they are in a few words.

    `module` is that of this package which has it; `maker` what in it makes an encoder of packets
    over UDP or, with `connects`, an output from an address, a port and an `Access`.
    """

    module: str
    maker: str
    port: int
    about: str
    connects: bool = False

    def open_encoder(self) -> Encoder:
        """A new encoder."""
        return self._make()

    def open_output(self, place: tuple[str, int], access: Access) -> Output:
        """A new output to a numeric address and a port."""
        return self._make(place, access) if self.connects else UdpOutput(self._make(), place)

    @property
    def _make(self) -> Any:
        return getattr(import_module(f"elocute.live.{self.module}"), self.maker)


TARGETS: dict[str, Target] = {
    "livelink": Target("live_link_face", "LiveLinkFace", 11111, "Live Link Face: Unreal Engine"),
    "vmc": Target("vmc", "vrm0", 39539, "VMC with the expressions of VRM 0"),
    "vmc-vrm1": Target("vmc", "vrm1", 39539, "VMC with the expressions of VRM 1"),
    "vmc-arkit": Target("vmc", "arkit", 39539, "VMC with ARKit's 52 curves"),
    "ifacialmocap": Target("ifacialmocap", "IFacialMocap", 49983, "iFacialMocap: Blender, Unity"),
    "osc": Target("osc", "Osc", 9000, "a message of OSC for each of ARKit's curves"),
    "vts": Target("vtube_studio", "VTubeStudio", 8001, "VTube Studio", True),
    "json": Target("json_lines", "JsonLines", 9871, "JSON of ARKit's curves"),
    "ws": Target("ws_server", "LiveServer", 9872, "WebSocket, and a page that shows it", True),
}
"""All that is needed to add one, beside its module."""


def open_outputs(wanted: Sequence[str], access: Access | None = None) -> list[Output]:
    """Outputs for targets as the command line names them.

    They are NAME, NAME=HOST, NAME=:PORT or NAME=HOST:PORT, with a name of `TARGETS`; other machines
    than this one are allowed by `access` alone.

    Raises
    ------
    InputError
        For an unknown name, no address, and another machine that was not allowed.
    OutputError
        Where a port cannot be listened on; MachineError without the extra that a target needs.
    """
    access = access or Access()
    chosen = [(TARGETS[name], place) for name, place in map(_parsed, wanted)]
    for target, (host, _) in chosen:
        if not access.allow_remote and not ip_address(host).is_loopback:
            raise InputError.about(
                f"target {host}",
                found=f"another machine for {target.about}",
                allowed="this machine",
                remedy="`allow_remote` sends to others, for all to read on the way",
            )
    opened: list[Output] = []
    try:
        for target, place in chosen:
            opened.append(target.open_output(place, access))
    except ElocuteError:
        for output in opened:
            output.close()
        raise
    return opened


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
