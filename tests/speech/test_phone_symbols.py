"""Phones in the alphabets of dictionaries, aligners and speech engines."""

from __future__ import annotations

import pytest

from elocute.encoders.phones_and_visemes import PHONES
from elocute.speech.phone_symbols import (
    ALPHABETS,
    AZURE_VISEMES,
    PROLONGS,
    SPOKEN_NOISE,
    alphabet_of,
    ipa_phones,
    nearest_symbols,
    phone_of,
    visemes_of,
)


@pytest.mark.parametrize(
    ("alphabet", "symbols", "phones"),
    [
        ("arpabet", "AH0 hh ER1 pcl axr dx", "AH HH ER P ER D"),
        ("ipa", "pʰ t͡ʃ aj ow ɑ̃ː b̥ ɹ̩ ɲ tɕ ç", "P CH AY OW AA B R N CH HH"),
        ("x-sampa", 'p_h tS @ 3` A: aI { r\\ l_= "a I@ d_d', "P CH AH ER AA AY AE R L AA IH D"),
        ("espeak", "3: a# I2 oU A@ t# n- @L tS 0 aI3", "ER AH IH OW AA T N AH CH AO AY"),
        ("azure", "0 21 18 19", "SIL P F T"),
        ("polly", "p f @ sil", "P F AH SIL"),
        ("ipa", "a˨ˀ˩ a̰˧ kʼ tsʼ ɓ ə˞ eː", "AA AA K S B ER EY"),
        ("x-sampa", "k_> p_> a~", "K P AA"),
        ("ipa", "ai̯˥˩ ʔb aʔ m̩ ʐ̩˥ aw̃", "AY B AA M ZH AW"),
        ("arpabet", "aan tq el silB", "AA SIL L SIL"),
        ("romaji", "a: q N ts", "AA SIL NG S"),
        ("pinyin", "q v4 zh i4 er2 ng b ü3", "CH UW JH IY ER NG B UW"),
        ("romaji", "ch i N cl sh U", "CH IY NG SIL SH UW"),
        ("oculus", "PP aa E ou sil viseme_kk", "P AA EH UW SIL K"),
        ("rhubarb", "A D F X", "P AA UW SIL"),
        ("blair", "MBP AI U rest", "P AA UW SIL"),
    ],
)
def test_symbols_are_phones(alphabet, symbols, phones):
    assert [phone_of(each, alphabet) for each in symbols.split()] == phones.split()


@pytest.mark.parametrize(
    ("alphabet", "symbol", "phones"),
    [
        ("ipa", "ɑːɹ", "AA R"),
        ("ipa", "əl", "AH L"),
        ("ipa", "ɔ˞", "AO R"),
        ("pinyin", "ia1", "Y AA"),
        ("pinyin", "ua3", "W AA"),
        ("pinyin", "zhong1", "JH UH NG"),
        ("pinyin", "nv3", "N UW"),
        ("pinyin", "qu4", "CH UW"),
        ("pinyin", "shi4", "SH IH"),
        ("pinyin", "yuan2", "W EH N"),
        ("romaji", "ky", "K Y"),
    ],
)
def test_one_symbol_can_be_several_phones(alphabet, symbol, phones):
    assert phone_of(symbol, alphabet) == phones


def test_espeak_s_symbols_for_english():
    assert [ipa_phones(each, "en-us") for each in ("oːɹ", "əl", "ɛɹ", "aɪɚ", "ɾ")] == [
        ["AO", "R"],
        ["AH", "L"],
        ["EH", "R"],
        ["AY", "ER"],
        ["D"],
    ]
    assert ipa_phones("tɕh", "cmn") == ["CH"] and ipa_phones("☃") == []


def test_noises_in_brackets_rest_or_are_somebody_s():
    assert {phone_of(each, "arpabet") for each in ("{NS}", "{SL}", "<p:>", "{B_TRANS}")} == {"SIL"}
    assert {phone_of(each, "arpabet") for each in ("{LG}", "{CG}", "<VOCNOISE>", "[x]")} == {
        SPOKEN_NOISE
    }
    assert phone_of("{", "x-sampa") == "AE" and phone_of("p:", "x-sampa") == "P"


def test_pauses_marks_and_noise_are_no_phones():
    assert {phone_of(each, "ipa") for each in ("sil", "", "<eps>", "SIL", "pau")} == {"SIL"}
    assert phone_of("ː", "ipa") == phone_of(":", "x-sampa") == PROLONGS
    assert phone_of("spn", "arpabet") == SPOKEN_NOISE
    assert phone_of("QQ", "arpabet") is phone_of("7", "ipa") is phone_of("22", "azure") is None


def test_all_that_any_alphabet_gives_is_a_phone():
    letters = [chr(code) for code in (*range(33, 0x180), *range(0x250, 0x2B0))]
    for alphabet in ALPHABETS:
        found = {phone_of(each, alphabet) for each in [*letters, *(a + ":" for a in letters)]}
        assert {each for phone in found for each in (phone or PROLONGS).split()} <= {
            *PHONES,
            SPOKEN_NOISE,
        }
    assert len(AZURE_VISEMES) == 22


def test_a_file_tells_its_alphabet():
    assert alphabet_of(["p", "t", "S", "dZ", "@", "aI"]) == ("x-sampa", [])
    assert alphabet_of(["P", "AH0", "XQ"]) == ("arpabet", ["XQ"])
    assert alphabet_of(["p", "ɑ", "tʃ"])[0] == "ipa"
    assert alphabet_of(["q", "v4", "j", "ia1"]) == ("pinyin", []), "v4 is no v"
    assert alphabet_of(["k", "o", "n", "i", "ch"]) == ("romaji", [])
    assert alphabet_of(["aa1", "ch", "iy0"]) == ("arpabet", [])
    assert alphabet_of(["sil", "PP", "aa", "TH", "RR"]) == ("oculus", [])
    assert alphabet_of(["rest", "MBP", "E", "U"]) == ("blair", [])
    assert alphabet_of(["X", "A", "D", ""]) == ("rhubarb", [])
    assert alphabet_of(["ss", "a", "kk", "eo"])[0] != "oculus", "Korean"
    assert alphabet_of(["A", "E"]) == ("x-sampa", []), "vowels of a phonetician"
    assert visemes_of(["21", "0"]) == "azure" and visemes_of(["E", "O"]) == "oculus"
    assert visemes_of(["@", "p"]) == "polly" and visemes_of(["m"]) == ""
    assert nearest_symbols("BB", "arpabet")[0] == "B"
