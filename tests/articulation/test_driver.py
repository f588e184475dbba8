"""The rule-based driver: contacts, rest, style, and no pops."""

import numpy as np
import pytest

from elocute.articulation.driver import articulate
from elocute.articulation.style import STYLES, Style
from elocute.encoders.phones_and_visemes import PHONES
from elocute.errors import InputError
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import sample_identity
from elocute.motion.curves import motion_from_curves
from elocute.speech.text.known_phones import posteriors_from_phones


def say(*phones, each_s=0.1, rest_s=0.6, style=None, **options):
    """Curves of phones of equal length with rests around them, and the time each begins."""
    times = [(rest_s + i * each_s, rest_s + (i + 1) * each_s, p) for i, p in enumerate(phones)]
    posteriors = posteriors_from_phones(times, 2 * rest_s + len(phones) * each_s)
    return articulate(posteriors, 50, style=style, **options), times


def at(curves, name, time_s):
    return curves[name][round(time_s * curves.fps)]


def test_a_bilabial_seals_the_lips_between_open_vowels():
    curves, times = say("AA", "P", "AA")
    middle = sum(times[1][:2]) / 2
    assert at(curves, "mouthClose", middle) == pytest.approx(at(curves, "jawOpen", middle))
    for parting in ("mouthLowerDownLeft", "mouthUpperUpLeft"):
        assert at(curves, parting, middle) < 0.01
    assert at(curves, "jawOpen", middle) < 0.5 * curves["jawOpen"].max()


@pytest.mark.parametrize("phone", ["F", "V"])
def test_a_labiodental_brings_the_lower_lip_to_the_teeth(phone):
    curves, times = say("AA", phone, "AA")
    assert at(curves, "mouthLabiodental", sum(times[1][:2]) / 2) > 0.8
    assert at(curves, "mouthLabiodental", sum(times[2][:2]) / 2 + 0.04) < 0.2


def test_without_contacts_there_is_only_coarticulation():
    """Lips only come near on p, teeth meet no lip on v, and a pause does not shut the mouth."""
    phones = "AA", "P", "AA", "V", "AA", "SIL", "SIL", "SIL", "SIL", "AA"
    finished, times = say(*phones)
    bare, _ = say(*phones, contacts=False)
    middle = {phone: sum(times[k][:2]) / 2 for k, phone in enumerate(phones)}
    assert bare.names == finished.names and len(bare.values) == len(finished.values)
    assert at(bare, "mouthClose", middle["P"]) < at(bare, "jawOpen", middle["P"])
    assert at(finished, "mouthLabiodental", middle["V"]) > at(bare, "mouthLabiodental", middle["V"])
    assert finished["jawOpen"][-6:].max() == 0 < bare["jawOpen"][-6:].max()


def test_open_vowels_open_more_than_close_ones():
    opened = {v: say("SIL", v, "SIL", each_s=0.2)[0]["jawOpen"].max() for v in ("AA", "EH", "IY")}
    assert opened["AA"] > opened["EH"] > opened["IY"] > 0.02


def test_rounded_vowels_pucker_and_spread_ones_do_not():
    assert say("UW", "UW")[0]["mouthPucker"].max() > 0.3
    assert say("IY", "IY")[0]["mouthPucker"].max() < 0.05


def test_a_diphthong_travels_from_its_first_to_its_second_vowel():
    curves, times = say("SIL", "AW", "SIL", each_s=0.3)
    start, end, _ = times[1]
    jaw_early, jaw_late = at(curves, "jawOpen", start + 0.08), at(curves, "jawOpen", end - 0.06)
    round_early = at(curves, "mouthPucker", start + 0.08)
    assert jaw_early > jaw_late
    assert at(curves, "mouthPucker", end - 0.06) > round_early


def test_silence_is_closed_and_exactly_still():
    curves = articulate(posteriors_from_phones([], 2.0), 50)
    assert np.abs(curves.values).max() == 0


def test_the_mouth_rests_before_and_after_speech():
    curves, _ = say("AA", "P", "IY", rest_s=1.0)
    for rest in (slice(0, 30), slice(-20, None)):
        assert np.abs(curves.values[rest]).max() == 0
    assert curves["jawOpen"].max() > 0.05


def test_nothing_moves_faster_than_a_face_can():
    """Lips of hurried talkers reach a few tenths of a metre a second."""
    curves, _ = say("P", "AA", "M", "IY", "F", "UW", "B", "AE", each_s=0.1)
    points = motion_from_curves(load_builtin_head(), curves).vertices()
    speed = np.linalg.norm(np.diff(points, axis=0), axis=2) * curves.fps
    assert 0.1 < speed.max() < 0.55


def test_a_clip_that_starts_and_ends_in_speech_has_no_pop():
    posteriors = posteriors_from_phones([(0, 0.5, "AA"), (0.5, 1.0, "IY")], 1.0)
    curves = articulate(posteriors, 50)
    assert np.abs(np.diff(curves.values, axis=0)).max() < 0.15


def test_frames_follow_the_sound_at_any_rate():
    posteriors = posteriors_from_phones([(0.5, 0.8, "AA")], 1.5)
    slow = articulate(posteriors, 50, fps=25)
    fast = articulate(posteriors, 50, fps=100)
    assert len(slow.values) == 38 and len(fast.values) == 150
    assert np.allclose(slow.values[:37], fast.values[: 37 * 4 : 4], atol=1e-5)


def test_a_blip_of_noise_does_not_wake_the_mouth():
    posteriors = posteriors_from_phones([(1.0, 1.04, "AA")], 2.0)
    assert np.abs(articulate(posteriors, 50).values).max() == 0


def test_styles_differ_where_they_say():
    plain = say("AA", "UW", "IY")[0]
    broad = say("AA", "UW", "IY", style=STYLES["broad"])[0]
    mumble = say("AA", "UW", "IY", style=STYLES["mumble"])[0]
    assert broad["jawOpen"].max() > plain["jawOpen"].max() > mumble["jawOpen"].max()


def test_strength_scales_motion_but_not_closure():
    half, times = say("AA", "P", "AA", strength=0.5)
    full, _ = say("AA", "P", "AA")
    middle = sum(times[1][:2]) / 2
    assert half["jawOpen"].max() == pytest.approx(0.5 * full["jawOpen"].max(), rel=0.05)
    assert at(half, "mouthClose", middle) == pytest.approx(at(half, "jawOpen", middle))


def test_asymmetry_leans():
    curves, _ = say("EH", "EH", style=Style(asymmetry=0.6))
    assert curves["mouthLowerDownRight"].max() > curves["mouthLowerDownLeft"].max()


@pytest.mark.parametrize(
    ("change", "word"),
    [({"amplitude": float("nan")}, "amplitude"), ({"asymmetry": 2}, "asymmetry")],
)
def test_a_style_out_of_range_is_refused(change, word):
    with pytest.raises(InputError, match=word):
        Style(**change)


def test_strength_and_phones_out_of_range_are_refused():
    posteriors = posteriors_from_phones([], 0.5)
    with pytest.raises(InputError, match="strength"):
        articulate(posteriors, 50, strength=9)
    with pytest.raises(InputError, match="XX"):
        posteriors_from_phones([(0, 1, "XX")], 1.0)


def test_phone_times_become_posteriors_that_sum_to_one():
    posteriors = np.exp(posteriors_from_phones([(0.1, 0.215, "AA"), (0.215, 0.3, "P")], 0.5))
    assert np.allclose(posteriors.sum(axis=1), 1, atol=1e-3)
    assert posteriors[7, PHONES.index("AA")] > 0.9
    assert posteriors[13, PHONES.index("P")] > 0.9


@pytest.mark.parametrize("vowel", ["AA", "AE", "IY", "UW", "OW", "W", "SH", "S"])
def test_lips_are_sealed_in_p_whoever_speaks_and_whatever_is_near(vowel):
    curves, times = say(vowel, "P", vowel, each_s=0.12)
    frame = round(sum(times[1][:2]) / 2 * curves.fps)
    for seed in (None, 1, 2, 3, 4, 5):
        head = load_builtin_head()
        if seed is not None:
            head = head.with_identity(sample_identity(seed))
        points = motion_from_curves(head, curves).vertices(frame, frame + 1)[0]
        gap = points[head.inner_lip_upper, 1] - points[head.inner_lip_lower, 1]
        assert 1000 * gap.max() <= 0.1
