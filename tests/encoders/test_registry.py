"""Every encoder by its name: shapes, rates, and what is refused."""

import numpy as np
import pytest
import python_speech_features as psf

from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.encoders.phone_encoder import PhoneEncoder
from elocute.encoders.registry import encoder_names, resolve_encoder
from elocute.errors import InputError
from tests.support.commands import run_python


@pytest.fixture(scope="module")
def speech(speech_wav) -> Waveform:
    whole = read_audio(speech_wav, sample_rate=16000)
    return Waveform(whole.samples[:48000], 16000)


def tone(count: int, rate: int = 16000) -> Waveform:
    samples = 0.1 * np.sin(2 * np.pi * 220 * np.arange(count) / rate)
    return Waveform(samples.astype(np.float32), rate)


def test_phones_are_the_default_and_the_network_that_ships(speech):
    encoder = resolve_encoder()
    features = encoder(speech)
    assert (encoder.name, encoder.feature_count, encoder.rate) == ("phones", 40, 50)
    assert (features.encoder, features.rate) == ("phones", 50)
    np.testing.assert_array_equal(features.values, PhoneEncoder().encode(speech.samples))


def test_fbank_equals_python_speech_features_every_twenty_milliseconds(speech):
    features = resolve_encoder("fbank")(speech)
    theirs = psf.logfbank(speech.samples.astype(float), 16000)[::2]
    assert (features.values.shape, features.rate) == ((150, 26), 50)
    np.testing.assert_allclose(features.values[: len(theirs)], theirs[:150], atol=1e-4)


def test_the_trunk_gives_its_middle_layer_and_zeros_where_nobody_speaks(speech):
    quiet = np.concatenate([np.zeros(16000, np.float32), speech.samples])
    encoder = resolve_encoder("trunk")
    values = encoder(Waveform(quiet, 16000)).values
    assert (encoder.name, encoder.feature_count, values.shape) == ("trunk", 512, (200, 512))
    assert not values[:40].any()
    # A row is normalised: nothing of the layer's own scale is left.
    spoken = values[np.abs(values).max(axis=1) > 0]
    assert len(spoken) > 100
    assert np.abs(spoken.mean(axis=1)).max() < 1e-5
    assert spoken.std(axis=1) == pytest.approx(1, abs=1e-3)


@pytest.mark.parametrize("name", ["phones", "trunk", "fbank"])
@pytest.mark.parametrize(
    ("count", "rate"),
    [(2, 16000), (479, 16000), (8001, 16000), (16160, 16000), (22050, 44100), (8000, 8000)],
)
def test_features_last_as_long_as_the_sound(name, count, rate):
    encoder = resolve_encoder(name)
    features = encoder(tone(count, rate))
    assert features.values.shape == (max(1, round(count * 50 / rate)), encoder.feature_count)


def test_every_encoder_is_listed():
    assert encoder_names() == (
        "phones",
        "trunk",
        "fbank",
        "deepspeech:PATH.pb",
        "wav2vec2:FOLDER",
        "hubert:FOLDER",
        "wavlm:FOLDER",
    )


@pytest.mark.parametrize("name", ["", "mfcc", "Phones", "phones ", ":x"])
def test_an_unknown_name_is_answered_with_the_known(name):
    with pytest.raises(
        InputError, match=r"phones, trunk, fbank, deepspeech:PATH\.pb, wav2vec2:FOLDER"
    ):
        resolve_encoder(name)


@pytest.mark.parametrize("name", ["phones:", "fbank:x", "deepspeech", "deepspeech:", "hubert"])
def test_a_path_stands_where_it_is_called_for_and_nowhere_else(name):
    with pytest.raises(InputError, match=f"allowed: {name.partition(':')[0]}"):
        resolve_encoder(name)


@pytest.mark.parametrize("kind", ["deepspeech", "wav2vec2", "hubert", "wavlm"])
def test_a_path_that_is_missing_is_named(kind, tmp_path):
    with pytest.raises(InputError, match="nowhere"):
        resolve_encoder(f"{kind}:{tmp_path / 'nowhere'}")


def test_resolving_loads_neither_torch_nor_onnxruntime():
    code = (
        "import sys; from elocute.encoders.registry import resolve_encoder as r; r(); r('fbank');"
        "import elocute.encoders.deepspeech, elocute.encoders.speech_transformer;"
        "print({'torch', 'onnx', 'onnxruntime', 'transformers'} & set(sys.modules))"
    )
    out = run_python("-c", code, check=True)
    assert out.stdout.strip() == "set()"
