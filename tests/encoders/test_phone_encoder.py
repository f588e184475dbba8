"""The shipped encoder: streamed or whole, what it may see, and whether it hears lips close."""

import json
import re
from pathlib import Path

import numpy as np
import onnxruntime
import pytest
import soundfile
import soxr

from elocute.encoders import phone_encoder, trunk
from elocute.encoders.phone_encoder import PhoneEncoder
from elocute.encoders.phones_and_visemes import PHONES
from elocute.errors import ModelError

EXAMPLE = Path(phone_encoder.__file__).parents[1] / "assets" / "example.flac"
BILABIAL = [PHONES.index(phone) for phone in ("P", "B", "M")]
LABIODENTAL = [PHONES.index(phone) for phone in ("F", "V")]
LIKELY = 0.35
REFERENCE = Path(__file__).parents[2] / "benchmarks" / "encoder_reference.json"
# As `recipes/example.py` printed them: "Hello. Give me any voice, and I will give it a face. My
# mouth closes on p, b and m. Five wolves move through the blue fog. Now I rest."
LIPS_CLOSE_S = {
    "me": 1.69,
    "my": 4.28,
    "mouth": 4.45,
    "p": 5.46,
    "b": 5.86,
    "m": 6.34,
    "move": 7.60,
    "blue": 8.18,
}
LIP_MEETS_TEETH_S = {
    "give": 1.61,
    "voice": 2.22,
    "give it": 3.31,
    "face": 3.54,
    "five": 6.93,
    "fi-ve": 7.18,
    "wolves": 7.46,
    "move": 7.78,
    "fog": 8.44,
}


@pytest.fixture(scope="module")
def encoder() -> PhoneEncoder:
    return PhoneEncoder()


@pytest.fixture(scope="module")
def speech() -> np.ndarray:
    samples, rate = soundfile.read(EXAMPLE, dtype="float32")
    return soxr.resample(samples, rate, 16000)


def streamed(encoder: PhoneEncoder, samples: np.ndarray, size: int) -> np.ndarray:
    stream = encoder.stream()
    parts = [stream.push(samples[at : at + size]) for at in range(0, len(samples), size)]
    return np.concatenate([*parts, stream.flush()])


@pytest.mark.parametrize("size", [333, 1600, 7777])
def test_a_stream_gives_what_the_whole_file_gives(encoder, speech, size):
    whole = encoder.encode(speech)
    np.testing.assert_array_equal(streamed(encoder, speech, size), whole)


def test_a_recording_longer_than_one_block_has_no_seams(encoder, speech, monkeypatch):
    whole = encoder.encode(speech)
    monkeypatch.setattr(trunk, "RUN_BLOCKS", 3)
    np.testing.assert_array_equal(encoder.encode(speech), whole)


@pytest.mark.parametrize("count", [0, 1, 320, 321, 16000])
def test_there_is_a_frame_for_every_twenty_milliseconds_begun(encoder, count):
    assert encoder.encode(np.zeros(count, np.float32)).shape == (-(-count // 320), 40)


def test_posteriors_sum_to_one(encoder, speech):
    np.testing.assert_allclose(np.exp(encoder.encode(speech)).sum(axis=1), 1, atol=1e-3)


def test_lookahead_is_within_half_a_second_and_as_declared(encoder, speech):
    assert encoder.lookahead_s <= 0.5
    at = 16000
    changed = speech.copy()
    changed[at:] = 0
    certain = int((at / 16000 - encoder.lookahead_s) * 50)
    before, after = encoder.encode(speech), encoder.encode(changed)
    np.testing.assert_array_equal(before[:certain], after[:certain])
    assert np.abs(before[certain + 4 :] - after[certain + 4 :]).max() > 0.1


def test_a_stream_lags_no_more_than_its_lookahead(encoder, speech):
    stream = encoder.stream()
    given = 0
    for at in range(0, 32000, 320):
        given += len(stream.push(speech[at : at + 320]))
        assert given / 50 >= (at + 320) / 16000 - encoder.lookahead_s - 0.02


def heard(encoder, samples, phones) -> np.ndarray:
    """(frame,) whether any of `phones` is likely."""
    return np.exp(encoder.encode(samples)[:, phones]).sum(axis=1) > LIKELY


@pytest.mark.parametrize(
    ("phones", "times"), [(BILABIAL, LIPS_CLOSE_S), (LABIODENTAL, LIP_MEETS_TEETH_S)]
)
def test_lips_are_heard_to_close_where_they_do_and_rarely_elsewhere(encoder, speech, phones, times):
    closed = heard(encoder, speech, phones)
    for word, time_s in times.items():
        frame = round(time_s * 50)
        assert closed[frame - 3 : frame + 4].any(), word
    assert closed.mean() < 0.25


@pytest.mark.shared_data
def test_bilabials_of_a_reader_it_never_heard(encoder, shared_data):
    clips = [c for c in json.loads(REFERENCE.read_text()) if c["source"] == "ljspeech_a"][:8]
    hit = total = 0
    for clip in clips:
        samples, _ = soundfile.read(shared_data / "speech" / clip["path"], dtype="float32")
        closed, at = heard(encoder, samples, BILABIAL), 0
        for phone, length in re.findall(r"([A-Z]+)(\d+)", clip["phones"]):
            if phone in ("P", "B", "M"):
                hit += closed[max(0, at - 2) : at + int(length) + 2].any()
                total += 1
            at += int(length)
    assert total > 20
    assert hit / total > 0.7


@pytest.mark.parametrize("level_db", [0, -20, -40])
def test_silence_is_heard_as_silence_and_speech_is_not(encoder, speech, level_db):
    quiet = np.zeros(16000, np.float32)
    sound = np.concatenate([quiet, speech * 10 ** (level_db / 20), quiet])
    silent = encoder.encode(sound).argmax(axis=1) == PHONES.index("SIL")
    assert silent[:45].mean() > 0.9
    assert silent[-40:].mean() > 0.9
    assert silent[50:-50].mean() < 0.5


def test_a_telephone_line_changes_little(encoder, speech):
    line = soxr.resample(soxr.resample(speech, 16000, 8000), 8000, 16000)[: len(speech)]
    clean, dull = encoder.encode(speech), encoder.encode(line)
    assert (clean.argmax(axis=1) == dull.argmax(axis=1)).mean() > 0.6


def test_the_file_is_small():
    assert trunk.SHIPPED_PATH.stat().st_size <= 14.5e6


def test_a_file_that_is_no_network_is_refused(tmp_path):
    path = tmp_path / "phones.onnx"
    path.write_bytes(b"not a network")
    with pytest.raises(ModelError, match=r"phones\.onnx"):
        PhoneEncoder(path).encode(np.zeros(16000, np.float32))
    with pytest.raises(ModelError, match="no such file"):
        PhoneEncoder(tmp_path / "none.onnx").encode(np.zeros(16000, np.float32))


def test_onnxruntime_uses_one_thread(encoder):
    assert isinstance(encoder.network.session, onnxruntime.InferenceSession)
    assert encoder.network.session.get_session_options().intra_op_num_threads == 1
