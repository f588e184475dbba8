"""Translates phone symbols of dictionaries, aligners and speech engines to PHONES.

Where another language has no such phone, the one that looks alike on the lips was taken: front
rounded vowels are rounded first of all, a uvular r does not show.
"""

from __future__ import annotations

import difflib
import re
import unicodedata
from collections.abc import Callable, Iterable

from elocute.encoders.phones_and_visemes import PHONES

PROLONGS = ""
"""What stands for a sign that prolongs the phone before it."""
REST = "SIL"
SPOKEN_NOISE = "spn"
"""Aligners write it over words that they do not know: some phone, nobody says which."""


def _names(text: str) -> tuple[str, ...]:
    return tuple(text.split())


def _by_symbol(table: str) -> dict[str, str]:
    """A table of `phone: its symbols; …` as phones by symbol."""
    lines = (line.split(": ") for line in " ".join(table.split()).split("; "))
    return {symbol: phone for phone, symbols in lines for symbol in symbols.split()}


# As aligners, corpora and synthesisers write pauses and noises that are no speech; in brackets
# there are more of them, and whatever else stands in brackets is spoken though nobody says how.
RESTS = _names(
    "sil silb sile sp eps pau pause h# # _ silence brth breath ssil epi nsn noise ... + ++"
)
BRACKETED_RESTS = (*RESTS, *_names("p: p s /s sl ns br b_trans e_trans iver nib"))
UNSAID = _names("spn unk oov vocnoise laugh laughter cough lipsmack garbage gb fp dummy usb ???")
WORD_RESTS = _names(
    "sil silb sile sp spn eps epi h# ssil nsn brth unk oov SIL SPN NSN !SIL !sil %HESITATION"
)
"""Labels in the place of a word that are none; others, such as silence and laughter, are words."""
_BRACKETED = re.compile(r"<(.+)>|\[(.+)\]|\((.+)\)|\{(.+)\}|\+\+(.+)\+\+")


# Longest match first; languages that differ override below.
IPA = _by_symbol(
    """
    SIL: ʔ; AA: a ɑ; AE: æ; AH: ə ɘ ɐ ʌ ɤ; AH L: əl; AO: oə ɔə ɒ ɔ; AW: aʊə aʊ ʌu aw au ɑu ɑʊ; AY:
    aɪə aɪ aj ai ɑi ɑɪ; B: b ʙ β ɓ; CH: tʃ tɕ tʂ ʧ ʨ; D: d ɖ ɗ; DH: ð; EH: eə ɛə ɛ; ER: ɜ ɞ ɚ ɝ;
    EY: eɪ ɛɪ ɛi ej ei e; F: pf f ɸ; G: ɡ g ɣ ɠ ɰ ɟ ɢ; HH: h ɦ ħ ʕ x χ ç ʁ ʀ; IH: ɪə ɪ ɨ ᵻ ɯ; IY:
    iə i; JH: dʒ dʑ dʐ ʤ ʥ; K: k c q; L: l ɫ ʎ ɬ ɭ ɮ ʟ ɺ; M: m; N: n ɲ ɳ; NG: ŋ ɴ; OW: oʊ əʊ œy ow
    əw ou əu o; OY: ɔɪ ɔø ɔʏ ɔy ɔj ɔi oi oɪ; P: p ʘ; R: ɹ r ɾ ɽ ɻ; S: ts s ʦ; SH: ʃ ɧ ɕ ʂ; T: t ʈ;
    TH: θ; UH: ʊə ʏ œ ɶ ʊ ɵ; UW: y ø u ʉ; V: ɱ v ʋ ⱱ; W: w ʍ ɥ; Y: j ʝ; Z: dz z ʣ; ZH: ʒ ʑ ʐ
    """
)

BY_LANGUAGE = {
    "en": {"a": "AE", "ɾ": "D", "e": "EH", "o": "OW", "aː": "AA", "oɹ": "AO R", "or": "AO R"},
}

_VOWELS = frozenset("iɪɨᵻyʏeɛøœɶaæɑɒɔouʊʉɵəɘɐʌɜɞɚɝɤɯ")
_GLIDES = frozenset("jwɥɰ")
_COLOURS = frozenset("ɹɫʁ")

# Stress, length and ties; small letters that say how, not what, are found by their kind.
_SILENT = set(".-_|;: \u200d'’‿")
_TONES = set("¹²³⁴⁵0123456789↗↘↓↑")

# The TIMIT corpus, CMU's, Festival's and MFA's dictionaries, beside the 39 of ARPAbet.
ARPABET_TOO = _by_symbol(
    """
    AH: AX AX-H; ER: AXR; IH: IX; D: DX DCL; L: EL; M: EM; N: EN NX; NG: ENG; HH: HV; UW: UX; W:
    WH; SIL: Q TQ; B: BCL; G: GCL; P: PCL; T: TCL; K: KCL
    """
)

_PAIRS = _names(
    r"""
    { æ } ʉ 1 ɨ 2 ø 3 ɜ 3\ ɞ 4 ɾ 5 ɫ 6 ɐ 7 ɤ 8 ɵ 9 œ & ɶ @ ə @\ ɘ A ɑ B β B\ ʙ C
    ç D ð E ɛ F ɱ G ɣ G\ ɢ H ɥ H\ ħ I ɪ I\ ɨ J ɲ J\ ɟ K ɬ K\ ɮ L ʎ L\ ʟ M ɯ M\ ɰ
    N ŋ N\ ɴ O ɔ O\ ʘ P ʋ Q ɒ R ʁ R\ ʀ S ʃ T θ U ʊ U\ ʊ V ʌ W ʍ X χ X\ ħ Y ʏ Z ʒ
    ? ʔ ?\ ʕ h\ ɦ j\ ʝ l\ ɺ p\ ɸ r\ ɹ s\ ɕ v\ ʋ x\ ɧ z\ ʑ g ɡ
    """
)
XSAMPA = {letter: letter for letter in "abcdefhijklmnopqrstuvwxyz"}
XSAMPA |= dict(zip(_PAIRS[::2], _PAIRS[1::2], strict=True))
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

# Finals of Mandarin in pinyin; v stands for ü. Those of -n and -ng follow from the vowel.
_FINALS = _by_symbol(
    """
    AA: a; AO: o; AH: e; IY: i; UW: u v; ER: er r; IH: ii iii; AY: ai; EY: ei; AW: ao; OW: ou; Y
    AA: ia; Y EH: ie; Y AW: iao; Y OW: iu iou; Y AO: io; W AA: ua va; W AO: uo; W AY: uai; W EY: ui
    uei; W EH: ue ve; W AH N: uen un; AH N: en; AH NG: eng; UH NG: ong; Y UH NG: iong; Y EH N: ian;
    W AH NG: ueng; W EH N: van; IY N: in; IY NG: ing
    """
)
_INITIALS = _by_symbol(
    """
    B: b; P: p; M: m; F: f; D: d; T: t; N: n; L: l; G: g; K: k; HH: h; JH: j zh; CH: q ch; SH: x
    sh; R: r; Z: z; S: c s; Y: y; W: w; NG: ng
    """
)
_PINYIN = re.compile(
    "(zh|ch|sh|ng|[bpmfdtnlgkhjqxrzcsyw])?([aeiouvr][aeiouvr]{0,2}(?:ng|n)?)?([0-5])?"
)
_ROMAJI = _by_symbol(
    """
    AA: a A; IY: i I; UW: u U; EH: e E; OW: o O; NG: N; SIL: cl Q q; CH: ch ty; SH: sh; S: s ts;
    JH: j jy; Z: z zy; F: f; HH: h hy; R: r ry; Y: y; W: w; V: v; K: k; G: g; N: n ny; B: b; P: p;
    M: m; T: t; D: d dy; K Y: ky; G Y: gy; B Y: by; P Y: py; M Y: my; K W: kw; G W: gw
    """
)

# The phone of each group that looks most like the group: Azure's visemes 0 to 21.
AZURE_VISEMES = (
    *("SIL", "AH", "AA", "AO", "EH", "ER", "IY", "UW", "OW", "AW", "OY"),
    *("AY", "HH", "R", "L", "S", "SH", "DH", "F", "T", "K", "P"),
)
VISEMES = {
    "azure": {str(number): phone for number, phone in enumerate(AZURE_VISEMES)},
    "polly": _by_symbol("""
        P: p; T: t; SH: S; TH: T; F: f; K: k; IY: i; R: r; S: s; UW: u; AH: @; AA: a; EY: e; EH: E;
        OW: o; AO: O; CH: J; B: B; SIL: sil
        """),
    "oculus": _by_symbol("""
        SIL: sil; P: PP; F: FF; TH: TH; T: DD; K: kk; CH: CH; S: SS; N: nn; R: RR; AA: aa; EH: E;
        IH: I ih; OW: O oh; UW: U ou
        """),
    "rhubarb": _by_symbol("""
        P: A; S: B; EH: C; AA: D; AO: E; UW: F; F: G; L: H; SIL: X
        """),
    "blair": _by_symbol("""
        P: MBP; S: etc; EH: E; AA: AI; AO: O; UW: U; W: WQ; F: FV; L: L; SIL: rest
        """),
}
"""Pictures of mouths by the names that engines and animators give them."""


def ipa_phone(symbol: str, language: str = "") -> str | None:
    """The first of `ipa_phones`; None for an unknown symbol."""
    return next(iter(ipa_phones(symbol, language)), None)


def ipa_phones(symbol: str, language: str = "") -> list[str]:
    """Phones for an IPA symbol with its marks, or for several symbols in a row: of PHONES,
    [PROLONGS] for a mark alone, none for an unknown symbol.

    The symbol is as espeak-ng, MFA and dictionaries write it: t, tʃ, also əl and ɑːɹ, which are
    two. The language, as `de` or `en-us`, says whose phones they are.
    """
    special = BY_LANGUAGE.get(language[:2], {})
    if symbol in special:
        return special[symbol].split()
    bare = _bare(symbol)
    if not bare:
        return [PROLONGS if symbol.strip("_ :|") else REST]
    phones: list[str] = []
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
            return phones
        breath = phones and head == "h" and bare[at - 1] not in _VOWELS
        phones += [] if breath else special.get(head, IPA.get(head, "")).split()
        at += len(head)
    return phones


def one_ipa_phone(symbol: str, language: str = "") -> str | None:
    """As `ipa_phones`, joined by spaces, but None for what is not a single symbol: a word
    has IPA's letters too."""
    bare = _bare(symbol)
    letters = set(bare)
    vowels = len(bare) <= 3 and letters <= _VOWELS | _GLIDES | _COLOURS and bare[:1] not in _COLOURS
    affricate = len(bare) <= 2 and not letters & _VOWELS
    alone = not bare and not any(letter.isalnum() for letter in symbol if _is_plain(letter))
    if not (bare in IPA or (bare and (vowels or affricate)) or alone):
        return None
    phones = ipa_phones(symbol, language)
    return " ".join(phones) if phones else None


def _bare(symbol: str) -> str:
    """The letters of an IPA symbol without marks, tones and accents; ˞ is an r."""
    for hooked, plain in (("ə˞", "ɚ"), ("ɜ˞", "ɝ"), ("˞", "ɹ")):
        symbol = symbol.replace(hooked, plain)
    letters = (
        letter if letter in IPA else unicodedata.normalize("NFD", letter)[0] for letter in symbol
    )
    bare = "".join(each for each in letters if _is_plain(each) and each not in _TONES)
    return bare.strip("ʔ") or bare  # beside a phone it says how that is made


def _is_plain(letter: str) -> bool:
    """Whether a letter says which phone it is: small letters, ties and marks of stress or of a
    creaky voice only say how."""
    return letter not in _SILENT and unicodedata.category(letter) not in ("Lm", "Sk", "Mn")


def arpabet_phone(symbol: str, language: str = "") -> str | None:
    """One of PHONES for a symbol of ARPAbet, with a digit of stress or none; None for others."""
    name = re.sub(r"[0-2]$", "", symbol.upper())
    if name[:-1] in PHONES and len(name) == 3 and name[2] == "N":  # Buckeye's nasal vowels
        name = name[:-1]
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


def pinyin_phone(symbol: str, language: str = "") -> str | None:
    """Phones, joined by spaces, of a syllable, an initial or a final of pinyin with its tone."""
    match = _PINYIN.fullmatch(symbol.replace("ü", "v").replace("u:", "v"))
    if match is None or not symbol:
        return None
    initial, final, tone = match.groups()
    if not final:
        return _INITIALS[initial] if initial and not tone else None
    if final == "i" and tone and initial in ("zh", "ch", "sh", "r", "z", "c", "s"):
        final = "ii"
    if initial in ("j", "q", "x", "y") and final[0] == "u":
        final = "v" + final[1:]
    if (initial, final[0]) in (("y", "i"), ("y", "v"), ("w", "u")):
        initial = None
    stem = next((final[:-cut] for cut in (2, 1) if final[-cut:] in ("ng", "n")), final)
    if final in _FINALS:
        vowel = _FINALS[final]
    elif stem in _FINALS:
        vowel = f"{_FINALS[stem]} {'NG' if final.endswith('ng') else 'N'}"
    else:
        return None
    return f"{_INITIALS[initial]} {vowel}" if initial else vowel


def romaji_phone(symbol: str, language: str = "") -> str | None:
    """Phones, joined by spaces, of a phone of OpenJTalk, VOICEVOX and Julius; capitals are
    voiceless."""
    return _ROMAJI.get(symbol.rstrip(":"))


def _viseme(kind: str) -> Callable[[str, str], str | None]:
    return lambda symbol, language="": VISEMES[kind].get(symbol.removeprefix("viseme_"))


ALPHABETS: dict[str, Callable[[str, str], str | None]] = {
    "arpabet": arpabet_phone,
    "ipa": one_ipa_phone,
    "x-sampa": xsampa_phone,
    "espeak": espeak_phone,
    "pinyin": pinyin_phone,
    "romaji": romaji_phone,
    **{kind: _viseme(kind) for kind in VISEMES},
}
"""Alphabets; of two that know all symbols of a file, the first is taken."""
GUESSED = ("arpabet", "ipa", "x-sampa", "espeak")
"""Alphabets that a file need not name."""
TELLING = {
    "pinyin": re.compile("[a-zü:]+[1-5]"),
    "romaji": re.compile("ch|sh|cl|[kgnhbpmr]y"),
    "oculus": re.compile("(?:viseme_)?(?:PP|FF|DD|kk|SS|nn|RR)"),
    "blair": re.compile("MBP|AI|FV|WQ|etc"),
    "rhubarb": re.compile("X"),  # its rest
}
"""Symbols that only one alphabet writes so: where it also knows all others, it is taken first."""


def phone_of(symbol: str, alphabet: str, language: str = "") -> str | None:
    """One of PHONES, or several joined by spaces, for a phone, a pause or a mark of an alphabet.

    PROLONGS stands for a mark alone, SPOKEN_NOISE where nobody knows the phone, None for what the
    alphabet has not. The language says whose phones they are, where it matters.
    """
    name = symbol.strip()
    # Kaldi marks the place of a phone in its word: AH_B, AH_I, AH_E, AH_S.
    name = re.sub(r"_[BIES]$", "", name)
    if not name or name.lower() in RESTS:
        return REST
    if name.lower() in UNSAID:
        return SPOKEN_NOISE
    if match := _BRACKETED.fullmatch(name):
        inner = next(filter(None, match.groups())).lower()
        return REST if inner in BRACKETED_RESTS else SPOKEN_NOISE
    return ALPHABETS[alphabet](name, language)


def is_word(label: str) -> bool:
    """Whether a label in the place of a word is one that is said: no mark of a pause or noise."""
    said = any(map(str.isalnum, label)) and label not in WORD_RESTS
    return said and _BRACKETED.fullmatch(label) is None


def alphabet_of(symbols: Iterable[str]) -> tuple[str, list[str]]:
    """The alphabet (of GUESSED or TELLING) that knows most of the symbols of a file, and the
    symbols that it does not know.
    """
    different = dict.fromkeys(symbols)
    for alphabet, telling in TELLING.items():
        if any(telling.fullmatch(each) for each in different) and all(
            phone_of(each, alphabet) is not None for each in different
        ):
            return alphabet, []
    strangers = {
        alphabet: [each for each in different if phone_of(each, alphabet) is None]
        for alphabet in GUESSED
    }
    best = min(GUESSED, key=lambda alphabet: len(strangers[alphabet]))
    return best, strangers[best]


def visemes_of(symbols: Iterable[str]) -> str:
    """The set of visemes that knows all of the symbols of a file, the usual one first; "" where
    none does.
    """
    different = dict.fromkeys(symbols)
    known = (
        kind
        for kind in ("oculus", *VISEMES)
        if all(phone_of(each, kind) is not None for each in different)
    )
    return next(known, "")


def nearest_symbols(symbol: str, alphabet: str) -> list[str]:
    """The symbols of an alphabet, three at most, spelled most like one that it lacks; nearest
    first.
    """
    known = {
        "arpabet": [*PHONES, *ARPABET_TOO],
        "ipa": [*IPA],
        "x-sampa": [*XSAMPA],
        "espeak": [*XSAMPA, *_ESPEAK],
        "pinyin": [*_INITIALS, *_FINALS],
        "romaji": [*_ROMAJI],
        **{kind: [*names] for kind, names in VISEMES.items()},
    }[alphabet]
    wanted = symbol.upper() if alphabet == "arpabet" else symbol
    return difflib.get_close_matches(wanted[:20], known, 3, 0.0)
