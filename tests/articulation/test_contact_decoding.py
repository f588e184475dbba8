"""Contacts decoded over a phrase."""

import numpy as np
import pytest

from elocute.articulation.contact_decoding import (
    AT_TEETH,
    BETWEEN_S,
    HOLD_S,
    LONGEST_S,
    SEALED,
    contact_states,
    contact_track,
    decoded_contacts,
    known_contacts,
)
from elocute.encoders.phones_and_visemes import PHONES
from elocute.speech.text.known_phones import posteriors_from_phones


def heard(*phones, each_s=0.1, blurred=0.0):
    """Posteriors of phones of equal length, and the time each begins."""
    times = [(i * each_s, (i + 1) * each_s, phone) for i, phone in enumerate(phones)]
    exact = np.exp(posteriors_from_phones(times, len(phones) * each_s))
    return (1 - blurred) * exact + blurred / len(PHONES)


def contacts(posteriors, kind=SEALED, first_row=0):
    return decoded_contacts(posteriors, 50.0, kind, first_row)


@pytest.mark.parametrize("phone", ["P", "B", "M"])
def test_lips_are_sealed_on_a_bilabial_and_only_there(phone):
    (seal,) = contacts(heard("AA", phone, "AA", blurred=0.3))
    assert 0.08 <= seal.start_s < seal.end_s <= 0.22
    assert HOLD_S <= seal.end_s - seal.start_s <= LONGEST_S
    assert contacts(heard("AA", phone, "AA"), AT_TEETH) == []


@pytest.mark.parametrize("phone", ["F", "V"])
def test_teeth_are_met_on_a_labiodental_without_a_seal(phone):
    posteriors = heard("AA", phone, "AA")
    assert contacts(posteriors) == []
    assert len(contacts(posteriors, AT_TEETH)) == 1


def test_three_doubtful_letters_make_a_sure_seal():
    """p, b and m share what is heard; none alone beats the n, together they do."""
    posteriors = heard("AA", "P", "AA")
    inside = slice(5, 10)
    posteriors[inside] = 0
    for phone, share in (("P", 0.22), ("B", 0.22), ("M", 0.22), ("N", 0.34)):
        posteriors[inside, PHONES.index(phone)] = share
    assert len(contacts(posteriors)) == 1


def test_a_flash_of_evidence_is_no_seal():
    posteriors = heard("AA", "AA", "AA")
    posteriors[7] = posteriors[7] * 0.3
    posteriors[7, PHONES.index("B")] = 0.7
    assert contacts(posteriors) == []


def test_lips_wait_for_a_first_p_and_do_not_pop_between_two():
    (seal,) = contacts(heard("SIL", "SIL", "P", "AA"))
    assert seal.start_s < 0.1
    quick = heard("AA", "AA", "P", "AH", "B", "AA", "AA", each_s=0.05)
    assert len(contacts(quick)) == 1
    apart = contacts(heard("AA", "P", "AA", "AA", "AA", "B", "AA"))
    assert len(apart) == 2 and apart[1].start_s - apart[0].end_s > BETWEEN_S


def test_a_hummed_m_is_sealed_as_long_as_it_is_hummed():
    (seal,) = contacts(heard("AA", "M", "AA", each_s=0.5))
    assert seal.end_s - seal.start_s > 0.4


@pytest.mark.parametrize("first", [0, 16, 37, 90])
def test_a_stretch_of_a_take_has_the_contacts_of_the_whole(first):
    draw = np.random.default_rng(0)
    names = draw.choice(PHONES, 60)
    posteriors = heard(*names, each_s=0.08, blurred=0.6)
    whole = contact_states(posteriors)
    part = contact_states(posteriors[first:200], first)
    inner = slice(first + 46 if first else 0, 200 - 36)
    assert (part[inner.start - first : inner.stop - first] == whole[inner]).all()


def test_the_track_is_full_in_contact_and_eased_outside():
    seals = contacts(heard("AA", "P", "AA"))
    times = np.arange(300) / 1000
    track = contact_track(seals, times)
    assert track[150] == 1 and track[40] == track[260] == 0
    assert 0 < np.abs(np.diff(track)).max() < 0.04  # over a millisecond


def test_nothing_heard_is_no_contact():
    assert contacts(np.zeros((0, 40))) == []


def known(*phones, seconds=0.5):
    return np.exp(posteriors_from_phones(list(phones), seconds))


def test_a_known_p_is_sealed_however_short_and_wherever_it_falls():
    """Heard, 15 ms of it would be a flash where it fills no row."""
    heard_too = 0
    for start in np.arange(0.2, 0.22, 0.004):
        posteriors = known(
            (0.1, start, "AA"), (start, start + 0.015, "P"), (start + 0.015, 0.4, "AA")
        )
        (seal,) = known_contacts(posteriors, 50.0, SEALED)
        assert seal.start_s < start + 0.0075 < seal.end_s
        assert known_contacts(posteriors, 50.0, AT_TEETH) == []
        heard_too += len(contacts(posteriors))
    assert heard_too < 5


def test_a_short_b_before_a_long_m_has_a_seal_of_its_own():
    said = [(0.1, 0.2, "AA"), (0.2, 0.22, "B"), (0.22, 0.32, "EY"), (0.32, 0.42, "M")]
    assert len(known_contacts(known(*said), 50.0, SEALED)) == 2


def test_a_known_row_that_a_phone_hardly_touches_is_no_contact():
    said = [(0.1, 0.2, "AA"), (0.2, 0.206, "P"), (0.206, 0.4, "AA")]
    assert known_contacts(known(*said), 50.0, SEALED) == []
