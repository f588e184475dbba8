"""The forty phones that the encoder recognises, and the fifteen visemes they belong to."""

from __future__ import annotations

# Silence and the 39 phones of ARPAbet without stress, in the order of the encoder's output.
PHONES: tuple[str, ...] = (
    "SIL",
    "AA",
    "AE",
    "AH",
    "AO",
    "AW",
    "AY",
    "B",
    "CH",
    "D",
    "DH",
    "EH",
    "ER",
    "EY",
    "F",
    "G",
    "HH",
    "IH",
    "IY",
    "JH",
    "K",
    "L",
    "M",
    "N",
    "NG",
    "OW",
    "OY",
    "P",
    "R",
    "S",
    "SH",
    "T",
    "TH",
    "UH",
    "UW",
    "V",
    "W",
    "Y",
    "Z",
    "ZH",
)
SILENCE = PHONES.index("SIL")
BILABIALS = ("P", "B", "M")
LABIODENTALS = ("F", "V")

# The fifteen visemes of the Oculus lip-sync reference, which VRM and most avatars share.
VISEMES: tuple[str, ...] = (
    "sil",
    "PP",
    "FF",
    "TH",
    "DD",
    "kk",
    "CH",
    "SS",
    "nn",
    "RR",
    "aa",
    "E",
    "ih",
    "oh",
    "ou",
)

_MEMBERS = {
    "sil": "SIL",
    "PP": "P B M",
    "FF": "F V",
    "TH": "TH DH",
    "DD": "T D",
    "kk": "K G NG HH",
    "CH": "CH JH SH ZH",
    "SS": "S Z",
    "nn": "N L",
    "RR": "R ER",
    "aa": "AA AH AY AW",
    "E": "EH AE EY",
    "ih": "IH IY Y",
    "oh": "AO OW OY",
    "ou": "UW UH W",
}

PHONE_TO_VISEME: dict[str, str] = {
    phone: viseme for viseme, phones in _MEMBERS.items() for phone in phones.split()
}
