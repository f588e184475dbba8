"""Phones in the alphabets of dictionaries, aligners and speech engines."""

from __future__ import annotations

import pytest

from elocute.audio.phone_symbols import (
    ALPHABETS,
    AZURE_VISEMES,
    PROLONGS,
    SPOKEN_NOISE,
    alphabet_of,
    nearest_symbols,
    phone_of,
)
from elocute.audio.phones_and_visemes import PHONES


@pytest.mark.parametrize(
    ("alphabet", "symbols", "phones"),
    [
        ("arpabet", "AH0 hh ER1 pcl axr dx", "AH HH ER P ER D"),
        ("ipa", "pʰ t͡ʃ aj ow ɑ̃ː b̥ ɹ̩ ɲ tɕ ç", "P CH AY OW AA B R N CH HH"),
        ("x-sampa", 'p_h tS @ 3` A: aI { r\\ l_= "a I@ d_d', "P CH AH ER AA AY AE R L AA IH D"),
        ("espeak", "3: a# I2 oU A@ t# n- @L tS 0 aI3", "ER AH IH OW AA T N AH CH AO AY"),
        ("azure", "0 21 18 19", "SIL P F T"),
        ("polly", "p f @ sil", "P F AH SIL"),
    ],
)
def test_symbols_are_phones(alphabet, symbols, phones):
    assert [phone_of(each, alphabet) for each in symbols.split()] == phones.split()


def test_pauses_marks_and_noise_are_no_phones():
    assert {phone_of(each, "ipa") for each in ("sil", "", "<eps>", "SIL", "pau")} == {"SIL"}
    assert phone_of("ː", "ipa") == phone_of(":", "x-sampa") == PROLONGS
    assert phone_of("spn", "arpabet") == SPOKEN_NOISE
    assert phone_of("QQ", "arpabet") is phone_of("7", "ipa") is phone_of("22", "azure") is None


def test_all_that_any_alphabet_gives_is_a_phone():
    letters = [chr(code) for code in (*range(33, 0x180), *range(0x250, 0x2B0))]
    for alphabet in ALPHABETS:
        found = {phone_of(each, alphabet) for each in [*letters, *(a + ":" for a in letters)]}
        assert found <= {*PHONES, PROLONGS, SPOKEN_NOISE, None}
    assert len(AZURE_VISEMES) == 22


def test_a_file_tells_its_alphabet():
    assert alphabet_of(["p", "t", "S", "dZ", "@", "aI"]) == ("x-sampa", [])
    assert alphabet_of(["P", "AH0", "XQ"]) == ("arpabet", ["XQ"])
    assert alphabet_of(["p", "ɑ", "tʃ"])[0] == "ipa"
    assert nearest_symbols("BB", "arpabet")[0] == "B"
