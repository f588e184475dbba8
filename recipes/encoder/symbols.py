"""Phone symbols of the synthesisers, mapped to the forty phones of the encoder."""

from __future__ import annotations

from elocute.encoders.phones_and_visemes import PHONES
from elocute.speech.phone_symbols import PROLONGS, REST, ipa_phone

FESTIVAL = {
    "ax": "AH",
    "axr": "ER",
    "ix": "IH",
    "dx": "D",
    "el": "L",
    "em": "M",
    "en": "N",
    "nx": "N",
    "hv": "HH",
    "ux": "UW",
    "pau": "SIL",
    "h#": "SIL",
    "brth": "SIL",
    "ssil": "SIL",
    "#": "SIL",
}


def from_ipa(symbol: str, language: str) -> str | None:
    """One of PHONES for an IPA symbol of espeak-ng; None for one that prolongs the last."""
    phone = ipa_phone(symbol, language)
    return None if phone == PROLONGS else phone or REST


def from_festival(symbol: str) -> str:
    """One of PHONES for a phone of festival or flite; raises KeyError for an unknown one."""
    name = FESTIVAL.get(symbol.lower(), symbol.upper())
    if name not in PHONES:
        raise KeyError(symbol)
    return name
