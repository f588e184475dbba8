"""Phone symbols of the synthesisers, mapped to the forty phones of the encoder.

Where another language has no such phone, the one that looks alike on the lips was taken: front
rounded vowels are rounded first of all, a uvular r does not show.
"""

from __future__ import annotations

from elocute.audio.phones_and_visemes import PHONES

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

# Longest match first; languages that differ override below.
IPA = {
    "tʃ": "CH",
    "dʒ": "JH",
    "tɕ": "CH",
    "dʑ": "JH",
    "tʂ": "CH",
    "dʐ": "JH",
    "ts": "S",
    "dz": "Z",
    "pf": "F",
    "aɪə": "AY",
    "aʊə": "AW",
    "aɪ": "AY",
    "aʊ": "AW",
    "ɔɪ": "OY",
    "ɔø": "OY",
    "ɔʏ": "OY",
    "ɔy": "OY",
    "eɪ": "EY",
    "ɛɪ": "EY",
    "ɛi": "EY",
    "oʊ": "OW",
    "əʊ": "OW",
    "ʌu": "AW",
    "œy": "OW",
    "ɪə": "IH",
    "iə": "IY",
    "eə": "EH",
    "ɛə": "EH",
    "ʊə": "UH",
    "oə": "AO",
    "ɔə": "AO",
    "i": "IY",
    "ɪ": "IH",
    "ɨ": "IH",
    "ᵻ": "IH",
    "y": "UW",
    "ʏ": "UH",
    "e": "EY",
    "ɛ": "EH",
    "ø": "UW",
    "œ": "UH",
    "a": "AA",
    "æ": "AE",
    "ɑ": "AA",
    "ɒ": "AO",
    "ɔ": "AO",
    "o": "OW",
    "u": "UW",
    "ʊ": "UH",
    "ʉ": "UW",
    "ɵ": "UH",
    "ə": "AH",
    "ɐ": "AH",
    "ʌ": "AH",
    "ɜ": "ER",
    "ɚ": "ER",
    "ɝ": "ER",
    "ɤ": "AH",
    "ɯ": "IH",
    "p": "P",
    "b": "B",
    "t": "T",
    "d": "D",
    "k": "K",
    "ɡ": "G",
    "g": "G",
    "m": "M",
    "n": "N",
    "ŋ": "NG",
    "f": "F",
    "v": "V",
    "θ": "TH",
    "ð": "DH",
    "s": "S",
    "z": "Z",
    "ʃ": "SH",
    "ʒ": "ZH",
    "h": "HH",
    "ɦ": "HH",
    "x": "HH",
    "χ": "HH",
    "ç": "HH",
    "ʁ": "HH",
    "ʀ": "HH",
    "ɧ": "SH",
    "l": "L",
    "ɫ": "L",
    "ʎ": "L",
    "ɬ": "L",
    "ɭ": "L",
    "ɹ": "R",
    "r": "R",
    "ɾ": "R",
    "ɻ": "R",
    "j": "Y",
    "ʝ": "Y",
    "w": "W",
    "ʍ": "W",
    "ɥ": "W",
    "ʋ": "V",
    "β": "B",
    "ɣ": "G",
    "ɲ": "N",
    "ʔ": "SIL",
    "ɕ": "SH",
    "ʑ": "ZH",
    "ʂ": "SH",
    "ʐ": "ZH",
    "ɖ": "D",
    "ʈ": "T",
    "ɳ": "N",
    "c": "K",
    "ɟ": "G",
    "q": "K",
    "ʦ": "S",
    "ʧ": "CH",
    "ʤ": "JH",
}

BY_LANGUAGE = {
    "en": {"a": "AE", "ɾ": "D", "e": "EH", "o": "OW", "aː": "AA"},
}

_SILENT = set("ˈˌː̩̯̃ʲʰˑ.-_|;: \u200d\u0361ˠ")


def from_ipa(symbol: str, language: str) -> str | None:
    """One of PHONES for an IPA symbol of espeak-ng; None for one that prolongs the last."""
    special = BY_LANGUAGE.get(language[:2], {})
    if symbol in special:
        return special[symbol]
    bare = "".join(letter for letter in symbol if letter not in _SILENT)
    if not bare:
        return None if symbol.strip("_ :|") else "SIL"
    for length in (3, 2, 1):
        head = bare[:length]
        if head in special:
            return special[head]
        if head in IPA:
            return IPA[head]
    return "SIL"


def from_festival(symbol: str) -> str:
    """One of PHONES for a phone of festival or flite; raises KeyError for an unknown one."""
    name = FESTIVAL.get(symbol.lower(), symbol.upper())
    if name not in PHONES:
        raise KeyError(symbol)
    return name
