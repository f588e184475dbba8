"""Speech in, motion out: on real speech, silence, noise and everything in between."""

import tracemalloc

import numpy as np
import pytest
import soundfile

import elocute
from elocute.animation import animate
from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.errors import InputError
from elocute.models.feature_extraction import extract_features
from elocute.models.registry import open_model
from elocute.motion.mouth_measures import measure_mouth


@pytest.fixture(scope="module")
def sound(speech_wav):
    return read_audio(speech_wav, sample_rate=16000)


def opening(waveform, **options):
    return measure_mouth(animate(waveform, life=0, **options).motion)["opening_mm"]


def test_one_call_does_it_all(speech_wav, tmp_path):
    elocute.animate(speech_wav).write(tmp_path / "talk.glb").write(tmp_path / "talk.npz")
    assert (tmp_path / "talk.glb").stat().st_size > 100_000
    motion = elocute.load_motion(tmp_path / "talk.npz")
    assert motion.fps == 60
    assert motion.duration_s == pytest.approx(soundfile.info(speech_wav).duration, abs=1 / 60)


def test_the_mouth_opens_in_speech_and_rests_around_it(sound):
    gap = opening(sound)
    assert np.percentile(gap, 90) > 4
    assert gap[:9].max() == 0 and gap[-20:].max() == 0  # then it breathes in


def test_a_file_and_its_samples_give_the_same(speech_wav, sound):
    by_file = animate(speech_wav).motion.weights
    by_samples = animate(sound).motion.weights
    assert np.abs(by_file - by_samples).max() < 1e-4


def test_thirty_seconds_whole_or_in_pieces(sound, monkeypatch):
    """The encoder hears a stream; how it is cut makes no difference."""
    from elocute.encoders.phone_encoder import builtin_encoder

    samples = np.tile(sound.samples, 4)[: 30 * 16000]
    whole = extract_features(open_model("articulation"), Waveform(samples, 16000))[
        0
    ].features.values
    stream = builtin_encoder().stream()
    cuts = np.cumsum(np.random.default_rng(0).integers(1, 40_000, 60))
    pieces = [stream.push(part) for part in np.split(samples, cuts[cuts < len(samples)])]
    pieces = np.concatenate([*pieces, stream.flush()])
    assert whole.shape == pieces.shape
    assert np.abs(whole - pieces).max() < 1e-3


def test_the_same_input_gives_the_same_motion(sound):
    assert np.array_equal(animate(sound).motion.weights, animate(sound).motion.weights)


@pytest.mark.parametrize("fps", [24, 25, 30, 60, 120])
def test_frames_cover_the_sound_at_any_rate(sound, fps):
    motion = animate(sound, fps=fps).motion
    assert motion.frame_count == int(np.ceil(sound.duration_s * fps))


class TestCalm:
    """Valid input that holds no speech gives a calm face."""

    def test_silence(self):
        assert opening(Waveform(np.zeros(32000, np.float32), 16000)).max() == 0

    def test_white_noise(self):
        noise = np.random.default_rng(1).normal(0, 0.1, 48000).astype(np.float32)
        assert np.percentile(opening(Waveform(noise, 16000)), 90) < 2

    def test_a_hum(self):
        hum = (0.2 * np.sin(2 * np.pi * 50 * np.arange(48000) / 16000)).astype(np.float32)
        assert np.percentile(opening(Waveform(hum, 16000)), 90) < 2

    def test_two_samples(self):
        assert animate(Waveform(np.array([0.1, -0.1], np.float32), 16000)).motion.frame_count == 1


class TestHard:
    """Speech that was recorded badly still moves the mouth as it should."""

    def likeness(self, sound, other):
        a, b = opening(sound), opening(other)
        count = min(len(a), len(b))
        return np.corrcoef(a[:count], b[:count])[0, 1]

    def test_quiet_speech_is_not_scaled_to_nothing(self, sound):
        level = np.sqrt(np.mean(sound.samples**2))
        quiet = Waveform(sound.samples * (10 ** (-60 / 20) / level), 16000)  # -60 dB of full scale
        assert np.percentile(opening(quiet), 90) > 4
        assert self.likeness(sound, quiet) > 0.75

    def test_a_telephone(self, sound):
        narrow = sound.resample(8000).resample(16000)
        assert self.likeness(sound, narrow) > 0.7

    def test_clipping(self, sound):
        limit = np.abs(sound.samples).max() * 0.2
        clipped = Waveform(np.clip(sound.samples, -limit, limit), 16000)
        assert self.likeness(sound, clipped) > 0.7

    def test_ten_decibels_of_noise(self, sound):
        noise = np.random.default_rng(2).normal(0, 1, len(sound.samples))
        noise *= sound.samples.std() * 10 ** (-10 / 20)
        noisy = Waveform(sound.samples + noise.astype(np.float32), 16000)
        assert self.likeness(sound, noisy) > 0.5


def test_identities_and_styles_change_the_face(sound):
    short = Waveform(sound.samples[:32000], 16000)
    plain = animate(short).motion
    other = animate(short, identity="7", style="broad").motion
    assert np.abs(plain.head.template - other.head.template).max() > 1e-3
    assert (
        other.weights[:, plain.names.index("jawOpen")].max()
        > plain.weights[:, plain.names.index("jawOpen")].max()
    )


def test_a_head_is_dressed_once_for_all_takes_and_files_of_a_person(sound):
    short = Waveform(sound.samples[:8000], 16000)
    one, other, casual = (
        animate(short, fps=5, look=look).motion for look in ("auto", "auto", "none")
    )
    assert one.head is other.head and one.dressed().head is other.dressed().head
    assert one.dressed().head.vertex_count > one.head.vertex_count
    assert casual.dressed().head is casual.head


def test_known_phone_times_replace_the_encoder():
    sound = Waveform(np.zeros(32000, np.float32), 16000)
    gap = opening(sound, phones=[(0.5, 0.7, "AA"), (0.7, 0.8, "P"), (0.8, 1.0, "AA")])
    assert gap[36] > 4 and gap[45] == 0 and gap[54] > 4


@pytest.mark.parametrize(
    ("options", "says"),
    [
        ({"fps": 0}, "fps"),
        ({"fps": float("nan")}, "fps"),
        ({"identity": "nobody"}, "identity"),
        ({"style": "operatic"}, "style"),
        ({"strength": -1}, "strength"),
        ({"model": "magic"}, "model"),
        ({"life": 2}, "life"),
        ({"life": "ears=1"}, "life"),
        ({"mood": "grumpy"}, "mood"),
    ],
)
def test_what_cannot_be_is_refused(sound, options, says):
    with pytest.raises(InputError, match=says):
        animate(sound, **options)


@pytest.mark.slow
def test_ten_minutes_need_little_memory(sound, tmp_path):
    """Half an hour would show the same: what grows is one row of weights per frame."""
    import soundfile

    path = tmp_path / "long.flac"
    soundfile.write(path, np.tile(sound.samples, 62), 16000)
    tracemalloc.start()
    animation = animate(path, fps=30)
    peak = tracemalloc.get_traced_memory()[1]
    tracemalloc.stop()
    assert animation.motion.duration_s > 600
    assert peak < 150e6


def test_words_of_a_text_keep_their_marks(speech_wav):
    """They are captions of the page, which break lines at them."""
    said = "Hello. Give me any voice, and I will give it a face."
    words = elocute.animate(speech_wav, text=said).words
    assert " ".join(word for *_, word in words) == said
