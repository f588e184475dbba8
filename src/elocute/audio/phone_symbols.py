"""Phone symbols of dictionaries, aligners and speech engines, as one of PHONES.

Where another language has no such phone, the one that looks alike on the lips was taken: front
rounded vowels are rounded first of all, a uvular r does not show.
"""

from __future__ import annotations

import difflib
import re
import unicodedata
from collections.abc import Callable, Iterable

from elocute.audio.phones_and_visemes import PHONES

PROLONGS = ""
"""What stands for a sign that prolongs the phone before it."""
REST = "SIL"
SPOKEN_NOISE = "spn"
"""Aligners write it over words that they do not know: some phone, nobody says which."""

# As aligners and synthesisers write pauses and noises that are no speech.
RESTS = frozenset(
    (
        *(
            "",
            "sil",
            "sp",
            "<sil>",
            "<eps>",
            "pau",
            "pause",
            "h#",
            "#",
            "_",
            "<p:>",
            "<p>",
            "silence",
        ),
        *("<s>", "</s>", "brth", "breath", "ssil", "epi", "nsn", "<nsn>", "noise", "<noise>"),
        *("{sl}", "[sil]", "...", "+", "++"),
    )
)

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
    # Diphthongs as MFA's dictionaries write them.
    "aj": "AY",
    "aw": "AW",
    "ej": "EY",
    "ow": "OW",
    "əw": "OW",
    "ɔj": "OY",
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
    "ɶ": "UH",
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
    "ɘ": "AH",
    "ɐ": "AH",
    "ʌ": "AH",
    "ɜ": "ER",
    "ɞ": "ER",
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
    "ɱ": "V",
    "n": "N",
    "ŋ": "NG",
    "ɴ": "NG",
    "f": "F",
    "ɸ": "F",
    "v": "V",
    "θ": "TH",
    "ð": "DH",
    "s": "S",
    "z": "Z",
    "ʃ": "SH",
    "ʒ": "ZH",
    "h": "HH",
    "ɦ": "HH",
    "ħ": "HH",
    "ʕ": "HH",
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
    "ɮ": "L",
    "ʟ": "L",
    "ɺ": "L",
    "ɹ": "R",
    "r": "R",
    "ɾ": "R",
    "ɽ": "R",
    "ɻ": "R",
    "ʙ": "B",
    "j": "Y",
    "ʝ": "Y",
    "w": "W",
    "ʍ": "W",
    "ɥ": "W",
    "ʋ": "V",
    "ⱱ": "V",
    "β": "B",
    "ɓ": "B",
    "ʘ": "P",
    "ɣ": "G",
    "ɠ": "G",
    "ɰ": "G",
    "ɲ": "N",
    "ʔ": "SIL",
    "ɕ": "SH",
    "ʑ": "ZH",
    "ʂ": "SH",
    "ʐ": "ZH",
    "ɖ": "D",
    "ɗ": "D",
    "ʈ": "T",
    "ɳ": "N",
    "c": "K",
    "ɟ": "G",
    "q": "K",
    "ɢ": "G",
    "ʦ": "S",
    "ʣ": "Z",
    "ʧ": "CH",
    "ʤ": "JH",
    "ʨ": "CH",
    "ʥ": "JH",
}

BY_LANGUAGE = {
    "en": {"a": "AE", "ɾ": "D", "e": "EH", "o": "OW", "aː": "AA", "oɹ": "AO R", "or": "AO R"},
}

_VOWELS = frozenset("iɪɨᵻyʏeɛøœɶaæɑɒɔouʊʉɵəɘɐʌɜɞɚɝɤɯ")
_GLIDES = frozenset("jwɥɰ")

# Stress, length, ties, and small letters that say how, not what.
_SILENT = set("ˈˌː̩̯̃ʲʰˑ.-_|;: \u200d\u0361ˠʷˤʱⁿˡ˞'’")
_TONES = set("˥˦˧˨˩¹²³⁴⁵0123456789")

# The TIMIT corpus, CMU's, Festival's and MFA's dictionaries, beside the 39 of ARPAbet.
ARPABET_TOO = {
    "AX": "AH",
    "AXR": "ER",
    "AX-H": "AH",
    "IX": "IH",
    "DX": "D",
    "EL": "L",
    "EM": "M",
    "EN": "N",
    "ENG": "NG",
    "NX": "N",
    "HV": "HH",
    "UX": "UW",
    "WH": "W",
    "Q": "SIL",
    "BCL": "B",
    "DCL": "D",
    "GCL": "G",
    "PCL": "P",
    "TCL": "T",
    "KCL": "K",
}

XSAMPA = {
    "{": "æ",
    "}": "ʉ",
    "1": "ɨ",
    "2": "ø",
    "3": "ɜ",
    "3\\": "ɞ",
    "4": "ɾ",
    "5": "ɫ",
    "6": "ɐ",
    "7": "ɤ",
    "8": "ɵ",
    "9": "œ",
    "&": "ɶ",
    "@": "ə",
    "@\\": "ɘ",
    "A": "ɑ",
    "B": "β",
    "B\\": "ʙ",
    "C": "ç",
    "D": "ð",
    "E": "ɛ",
    "F": "ɱ",
    "G": "ɣ",
    "G\\": "ɢ",
    "H": "ɥ",
    "H\\": "ħ",
    "I": "ɪ",
    "I\\": "ɨ",
    "J": "ɲ",
    "J\\": "ɟ",
    "K": "ɬ",
    "K\\": "ɮ",
    "L": "ʎ",
    "L\\": "ʟ",
    "M": "ɯ",
    "M\\": "ɰ",
    "N": "ŋ",
    "N\\": "ɴ",
    "O": "ɔ",
    "O\\": "ʘ",
    "P": "ʋ",
    "Q": "ɒ",
    "R": "ʁ",
    "R\\": "ʀ",
    "S": "ʃ",
    "T": "θ",
    "U": "ʊ",
    "U\\": "ʊ",
    "V": "ʌ",
    "W": "ʍ",
    "X": "χ",
    "X\\": "ħ",
    "Y": "ʏ",
    "Z": "ʒ",
    "?": "ʔ",
    "?\\": "ʕ",
    "h\\": "ɦ",
    "j\\": "ʝ",
    "l\\": "ɺ",
    "p\\": "ɸ",
    "r\\": "ɹ",
    "s\\": "ɕ",
    "v\\": "ʋ",
    "x\\": "ɧ",
    "z\\": "ʑ",
    "a": "a",
    "b": "b",
    "c": "c",
    "d": "d",
    "e": "e",
    "f": "f",
    "g": "ɡ",
    "h": "h",
    "i": "i",
    "j": "j",
    "k": "k",
    "l": "l",
    "m": "m",
    "n": "n",
    "o": "o",
    "p": "p",
    "q": "q",
    "r": "r",
    "s": "s",
    "t": "t",
    "u": "u",
    "v": "v",
    "w": "w",
    "x": "x",
    "y": "y",
    "z": "z",
}
# What follows a letter: length, stress, `_h` and others, a retroflex `, and ends of diacritics.
_XSAMPA_PARTS = re.compile(r"([A-Za-z0-9{}&@?]\\?)(?:`|_[A-Za-z0-9?~=^<>+\-\"}/\\])*|[:~=\"%'.|!-]")
# espeak-ng's mnemonics are like X-SAMPA, but for these; signs at their end tell variants.
_ESPEAK = {
    "0": "ɒ",
    "a": "æ",
    "a#": "ɐ",
    "aa": "æ",
    "A@": "ɑ",
    "@L": "ə",
    "3": "ɚ",
    "8": "ɵ",
    "Y": "ʏ",
    "y": "y",
}
_ESPEAK_VARIANT = re.compile(r"(?<=.)[#2-9;'!^\"-]+$")

# The phone of each group that looks most like the group: Azure's visemes 0 to 21.
AZURE_VISEMES = (
    *("SIL", "AH", "AA", "AO", "EH", "ER", "IY", "UW", "OW", "AW", "OY"),
    *("AY", "HH", "R", "L", "S", "SH", "DH", "F", "T", "K", "P"),
)
POLLY_VISEMES = {
    "p": "P",
    "t": "T",
    "S": "SH",
    "T": "TH",
    "f": "F",
    "k": "K",
    "i": "IY",
    "r": "R",
    "s": "S",
    "u": "UW",
    "@": "AH",
    "a": "AA",
    "e": "EY",
    "E": "EH",
    "o": "OW",
    "O": "AO",
    "J": "CH",
    "B": "B",
    "sil": "SIL",
}


def ipa_phone(symbol: str, language: str = "") -> str | None:
    """The first of `ipa_phones`; None for an unknown symbol."""
    return next(iter(ipa_phones(symbol, language)), None)


def ipa_phones(symbol: str, language: str = "") -> list[str]:
    """Phones for an IPA symbol with its marks, or for several symbols in a row.

    Parameters
    ----------
    symbol : str
        As espeak-ng, MFA and dictionaries write it: t, tʃ, also əl and ɑːɹ, which are two.
    language : str
        Whose phones they are, as `de` or `en-us`.

    Returns
    -------
    list of str
        Of PHONES; [PROLONGS] for a mark alone, none for an unknown symbol.
    """
    special = BY_LANGUAGE.get(language[:2], {})
    if symbol in special:
        return special[symbol].split()
    bare = _bare(symbol)
    if not bare:
        return [PROLONGS if symbol.strip("_ :|") else REST]
    found: list[str] = []
    at = 0
    while at < len(bare):
        head = next(
            (
                bare[at : at + length]
                for length in (3, 2, 1)
                if bare[at : at + length] in special or bare[at : at + length] in IPA
            ),
            None,
        )
        if head is None:
            return found
        breath = found and head == "h" and bare[at - 1] not in _VOWELS
        found += [] if breath else special.get(head, IPA.get(head, "")).split()
        at += len(head)
    return found


def one_ipa_phone(symbol: str, language: str = "") -> str | None:
    """As `ipa_phone`, but None for what is more than one phone: a word has IPA's letters too."""
    bare = _bare(symbol)
    letters = set(bare)
    vowels = len(bare) <= 3 and letters <= _VOWELS | _GLIDES
    affricate = len(bare) <= 2 and not letters & _VOWELS
    alone = not bare and not any(letter.isalnum() for letter in symbol if letter not in _SILENT)
    if not (bare in IPA or (bare and (vowels or affricate)) or alone):
        return None
    return ipa_phone(symbol, language)


def _bare(symbol: str) -> str:
    """The letters of an IPA symbol without marks, tones and accents."""
    letters = (
        letter if letter in IPA else unicodedata.normalize("NFD", letter)[0] for letter in symbol
    )
    return "".join(
        each
        for each in letters
        if each not in _SILENT and each not in _TONES and not unicodedata.combining(each)
    )


def arpabet_phone(symbol: str, language: str = "") -> str | None:
    """One of PHONES for a symbol of ARPAbet, with a digit of stress or none; None for others."""
    name = re.sub(r"[0-2]$", "", symbol.upper())
    name = ARPABET_TOO.get(name, name)
    return name if name in PHONES else None


def xsampa_phone(symbol: str, language: str = "") -> str | None:
    """One of PHONES for a symbol of X-SAMPA; PROLONGS and None as `ipa_phone`."""
    letters, at = "", 0
    while at < len(symbol):
        match = _XSAMPA_PARTS.match(symbol, at)
        if match is None:
            return None
        if match.group(1):
            if match.group(1) not in XSAMPA:
                return None
            letters += XSAMPA[match.group(1)]
        at = match.end()
    return one_ipa_phone(letters, language) if letters else PROLONGS


def espeak_phone(symbol: str, language: str = "") -> str | None:
    """One of PHONES for a mnemonic of espeak-ng (`espeak-ng -x`); PROLONGS and None as above."""
    for name in (symbol, symbol.rstrip(":"), _ESPEAK_VARIANT.sub("", symbol)):
        if name in _ESPEAK:
            return ipa_phone(_ESPEAK[name], language)
    return xsampa_phone(_ESPEAK_VARIANT.sub("", symbol) or symbol, language)


def azure_phone(symbol: str, language: str = "") -> str | None:
    """The phone that stands for one of Azure's visemes, 0 to 21; None for others."""
    known = symbol.isascii() and symbol.isdigit() and int(symbol[:3]) < len(AZURE_VISEMES)
    return AZURE_VISEMES[int(symbol)] if known and len(symbol) < 3 else None


def polly_phone(symbol: str, language: str = "") -> str | None:
    """The phone that stands for one of Polly's visemes; None for others."""
    return POLLY_VISEMES.get(symbol)


ALPHABETS: dict[str, Callable[[str, str], str | None]] = {
    "arpabet": arpabet_phone,
    "ipa": one_ipa_phone,
    "x-sampa": xsampa_phone,
    "espeak": espeak_phone,
    "azure": azure_phone,
    "polly": polly_phone,
}
"""Of two that know a whole file, the first is taken."""
GUESSED = ("arpabet", "ipa", "x-sampa", "espeak")
"""Those that a file need not name: visemes are known by their format."""


def phone_of(symbol: str, alphabet: str, language: str = "") -> str | None:
    """One of PHONES for a symbol.

    Parameters
    ----------
    symbol : str
        A phone, a pause, or a mark.
    alphabet : str
        One of ALPHABETS.
    language : str
        Whose phones they are, where it matters.

    Returns
    -------
    str or None
        PROLONGS for a mark alone, SPOKEN_NOISE where nobody knows the phone, None for what the
        alphabet has not.
    """
    name = symbol.strip()
    # Kaldi marks the place of a phone in its word: AH_B, AH_I, AH_E, AH_S.
    name = re.sub(r"_[BIES]$", "", name)
    if not name or name.lower() in RESTS:
        return REST
    if name.lower().strip("<>[]") in (SPOKEN_NOISE, "unk", "oov"):
        return SPOKEN_NOISE
    return ALPHABETS[alphabet](name, language)


def alphabet_of(symbols: Iterable[str]) -> tuple[str, list[str]]:
    """The alphabet that knows most of the symbols of a file.

    Parameters
    ----------
    symbols : iterable of str
        Of one file.

    Returns
    -------
    alphabet : str
        One of GUESSED.
    unknown : list of str
        The symbols that it does not know.
    """
    different = dict.fromkeys(symbols)
    strangers = {
        alphabet: [each for each in different if phone_of(each, alphabet) is None]
        for alphabet in GUESSED
    }
    best = min(GUESSED, key=lambda alphabet: len(strangers[alphabet]))
    return best, strangers[best]


def nearest_symbols(symbol: str, alphabet: str) -> list[str]:
    """The symbols of an alphabet that are spelled most like one that it does not have.

    Parameters
    ----------
    symbol : str
        The unknown symbol.
    alphabet : str
        One of ALPHABETS.

    Returns
    -------
    list of str
        Three at most, the nearest first.
    """
    known = {
        "arpabet": [*PHONES, *ARPABET_TOO],
        "ipa": [*IPA],
        "x-sampa": [*XSAMPA],
        "espeak": [*XSAMPA, *_ESPEAK],
        "azure": [str(number) for number in range(len(AZURE_VISEMES))],
        "polly": [*POLLY_VISEMES],
    }[alphabet]
    wanted = symbol.upper() if alphabet == "arpabet" else symbol
    return difflib.get_close_matches(wanted[:20], known, 3, 0.0)
