"""Who may ask a server of this machine: by the Host and the Origin of a request, and how often."""

from __future__ import annotations

import os
import re
import secrets
import time
from collections import OrderedDict
from collections.abc import Callable, Iterable
from ipaddress import ip_address

SENDERS_MAX = 20_000
"""Senders and tokens whose rates are remembered; the oldest are forgotten."""
HEADERS = {
    "content-security-policy": "default-src 'none'; script-src 'self'; style-src 'self'; "
    "connect-src 'self'; media-src blob:; img-src 'self'; base-uri 'none'; form-action 'none'; "
    "frame-ancestors 'none'",
    "x-content-type-options": "nosniff",
    "x-frame-options": "DENY",
    "referrer-policy": "no-referrer",
    "cross-origin-opener-policy": "same-origin",
    "cross-origin-resource-policy": "same-origin",
    "permissions-policy": "camera=(), microphone=(), geolocation=(), interest-cohort=()",
    "x-robots-tag": "noindex",
}
TOKEN = "ELOCUTE_LIVE_TOKEN"
Fields = dict[str, list[str]]
"""The values of each header, by its name in small letters."""


def fields_of(headers: Iterable[tuple[bytes, bytes]]) -> Fields:
    """Headers as they came, by name."""
    fields: Fields = {}
    for name, value in headers:
        fields.setdefault(name.decode("latin-1").lower(), []).append(value.decode("latin-1"))
    return fields


def access_token(*, allow_remote: bool) -> str:
    """What who connects has to know: `TOKEN` of the environment; else other machines alone need
    one, which is made."""
    return os.environ.get(TOKEN, "") or (secrets.token_urlsafe(16) if allow_remote else "")


class Rates:
    """How often each sender may ask: so many at once, and so many a second.

    Parameters
    ----------
    burst : float
        At once.
    each_s : float
        More in each second.
    clock : callable
        Seconds.
    """

    def __init__(
        self, burst: float, each_s: float, clock: Callable[[], float] = time.monotonic
    ) -> None:
        self._burst, self._each_s, self._clock = burst, each_s, clock
        self._left: OrderedDict[str, tuple[float, float]] = OrderedDict()

    def allows(self, sender: str) -> bool:
        """Count one more of a sender; whether it may pass."""
        now = self._clock()
        left, at = self._left.pop(sender, (self._burst, now))
        left = min(self._burst, left + (now - at) * self._each_s)
        allowed = left >= 1
        self._left[sender] = (left - 1 if allowed else left, now)
        if len(self._left) > SENDERS_MAX:
            self._left.popitem(last=False)
        return allowed


def host_names(hosts: Iterable[str], port: int) -> frozenset[str]:
    """What a Host header may be, of names with a port or without, in small letters.

    Each with its own port, or with the one on which the server listens, or without any.
    """
    allowed: set[str] = set()
    for host in hosts:
        name = host.lower()
        allowed.add(name)
        if not re.search(r":\d+$", name) or name.endswith("]"):
            allowed.add(f"{name}:{port}")
    return frozenset(allowed)


class Gate:
    """Lets requests in whose Host is the server's own, and whose Origin is so where they have one.

    Parameters
    ----------
    hosts : frozenset of str
        Allowed values of Host, from `host_names`.
    senders : Rates
        For each address that requests come from.
    origins : iterable of str
        Other pages whose requests are let in, "https://studio.example".
    numeric : bool
        Whether Host may also be any address in numbers: a name that another page has turned to
        this machine is none.
    """

    def __init__(
        self,
        hosts: frozenset[str],
        senders: Rates,
        *,
        origins: Iterable[str] = (),
        numeric: bool = False,
    ) -> None:
        self._hosts, self._senders, self._numeric = hosts, senders, numeric
        self._guests = frozenset(origin.lower() for origin in origins)

    def refusal(self, client: str, fields: Fields, *, is_page: bool) -> tuple[int, str] | None:
        """Status and reason, None where a request may pass; a link may lead to a page."""
        if not self._senders.allows(client):
            return 429, "often"
        host = fields.get("host", [])
        if len(host) != 1 or not self._knows(host[0].lower()):
            return 421, "host"
        origins = [origin.lower() for origin in fields.get("origin", [])]
        if origins and self._guests.issuperset(origins):
            return None
        own = {f"{scheme}://{name}" for scheme in ("http", "https") for name in self._own(host[0])}
        if not own.issuperset(origins):
            return 403, "origin"
        sites = fields.get("sec-fetch-site", ["none"])
        if not {"same-origin", "none"}.issuperset(sites) and not (is_page and _is_visit(fields)):
            return 403, "origin"
        return None

    def _knows(self, host: str) -> bool:
        return host in self._hosts or (self._numeric and _is_numeric(host))

    def _own(self, host: str) -> frozenset[str]:
        """Hosts whose pages are the server's own: where any address is let in, that alone."""
        return self._hosts if host.lower() in self._hosts else frozenset({host.lower()})


def _is_visit(fields: Fields) -> bool:
    """Somebody who follows a link of another page."""
    return fields.get("sec-fetch-mode") == ["navigate"] and fields.get("sec-fetch-dest") == [
        "document"
    ]


def _is_numeric(host: str) -> bool:
    name = re.sub(r":\d{1,5}$", "", host) if not host.endswith("]") else host
    try:
        return bool(ip_address(name.removeprefix("[").removesuffix("]")))
    except ValueError:
        return False
