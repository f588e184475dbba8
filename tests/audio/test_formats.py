"""Every format gives back the speech that was put into it, at the time it was put there."""

import shutil

import numpy as np
import pytest
import soundfile
import soxr

from elocute.audio import open_audio, probe_audio, read_audio, resampled_blocks
from elocute.errors import AudioError

# name, codec, rate, picture, options
CONTAINERS = [
    ("a.mp3", "libmp3lame", 44100, None, {}),
    ("a.opus", "libopus", 48000, None, {}),
    ("a.ogg", "libopus", 48000, None, {}),
    ("a.m4a", "aac", 44100, None, {}),
    ("fast.m4a", "aac", 44100, None, {"movflags": "faststart"}),
    ("alac.m4a", "alac", 44100, None, {}),
    ("a.mp4", "aac", 48000, "libx264", {}),
    ("a.mov", "pcm_s16le", 16000, "mpeg4", {}),
    ("a.mkv", "libopus", 48000, "libx264", {}),
    ("aac.mkv", "aac", 44100, None, {}),
    ("a.webm", "libopus", 48000, "libvpx", {}),
    ("sound.webm", "libopus", 48000, None, {}),
]


@pytest.mark.parametrize(("name", "codec", "rate", "picture", "options"), CONTAINERS)
def test_a_container_gives_the_speech_without_delay(
    tmp_path, speech, name, codec, rate, picture, options, encode, lag_and_likeness
):
    original = speech(rate)
    path = encode(tmp_path / name, original, rate, codec, picture=picture, options=options)
    heard = read_audio(path)
    assert heard.sample_rate == rate
    assert heard.duration_s == pytest.approx(3.0, abs=0.03)
    lag, likeness = lag_and_likeness(heard.samples, original)
    assert abs(lag) <= 1
    assert likeness > 0.99
    info = probe_audio(path)
    assert (info.sample_rate, info.channels) == (rate, 1)
    assert info.duration_s == pytest.approx(3.0, abs=0.06)


@pytest.mark.parametrize("name", ["a.aac", "a.ts", "a.avi", "fragments.mp4"])
def test_a_container_that_cannot_state_the_encoder_delay_is_within_one_picture(
    tmp_path, speech, name, encode, lag_and_likeness
):
    original = speech(44100)
    codec = "libmp3lame" if name == "a.avi" else "aac"
    fragments = {"movflags": "frag_keyframe+empty_moov"} if name == "fragments.mp4" else {}
    path = encode(tmp_path / name, original, 44100, codec, options=fragments)
    lag, likeness = lag_and_likeness(read_audio(path).samples, original)
    assert 0 <= lag / 44100 < 1 / 30
    assert likeness > 0.98


@pytest.mark.parametrize(
    ("name", "codec", "rate"), [("a.mp4", "aac", 44100), ("a.mkv", "libopus", 48000)]
)
def test_sound_that_starts_after_the_picture_keeps_its_place(
    tmp_path, speech, name, codec, rate, encode, lag_and_likeness
):
    original = speech(rate)
    path = encode(tmp_path / name, original, rate, codec, picture="libx264", start_s=0.5)
    lag, likeness = lag_and_likeness(read_audio(path).samples, original)
    assert lag / rate == pytest.approx(0.5, abs=0.002)
    assert likeness > 0.99
    assert probe_audio(path).duration_s == pytest.approx(3.5, abs=0.03)


@pytest.mark.parametrize(
    ("name", "codec"), [("a.mkv", "libopus"), ("a.webm", "libopus"), ("a.mp4", "aac")]
)
def test_sound_alone_begins_when_its_file_does(
    tmp_path, speech, name, codec, encode, lag_and_likeness
):
    original = speech(48000)
    path = encode(tmp_path / name, original, 48000, codec, start_s=1.0)
    heard = read_audio(path).samples
    lag, likeness = lag_and_likeness(heard, original)
    assert abs(lag) / 48000 < 1 / 40 and likeness > 0.99
    assert len(heard) / 48000 == pytest.approx(3.0, abs=0.04)
    assert probe_audio(path).duration_s == pytest.approx(3.0, abs=0.04)
    whole = path.read_bytes()
    path.write_bytes(whole[: 2 * len(whole) // 3])
    with pytest.raises(AudioError, match="cut off"):
        read_audio(path)


@pytest.mark.parametrize(
    ("name", "codec"), [("a.mp4", "aac"), ("a.webm", "libopus"), ("a.ts", "aac")]
)
def test_sound_behind_a_gap_keeps_its_place(
    tmp_path, speech, name, codec, encode, lag_and_likeness
):
    """Recorders of calls leave out packets that were lost or silent."""
    original = speech(48000)
    path = encode(tmp_path / name, original, 48000, codec, gap=(1.5, 0.75))
    with open_audio(path) as stream:
        heard = np.concatenate([*stream.blocks()])
        assert stream.notes == ["of the sound 0.75 s are missing in between, and are silence"]
    tail = original[round(1.6 * 48000) :]
    lag, likeness = lag_and_likeness(heard[round(2.35 * 48000) :], tail)
    assert abs(lag) / 48000 < 1 / 40
    assert likeness > 0.98
    assert len(heard) / 48000 == pytest.approx(3.75, abs=0.03)


def test_mpeg_sound_in_a_wav(tmp_path, speech, encode, lag_and_likeness):
    path = encode(tmp_path / "a.wav", speech(44100), 44100, "libmp3lame")
    lag, likeness = lag_and_likeness(read_audio(path).samples, speech(44100))
    assert 0 <= lag / 44100 < 1 / 30  # which its header cannot state
    assert likeness > 0.98


WIDTHS = {
    "PCM_U8": 2 / 256,
    "PCM_16": 2 / 2**16,
    "PCM_24": 2 / 2**24,
    "PCM_32": 2e-7,
    "FLOAT": 0,
    "DOUBLE": 0,
    "ULAW": 0.02,
    "ALAW": 0.02,
    "IMA_ADPCM": 0.3,
}


@pytest.mark.parametrize(
    ("kind", "subtype"),
    [
        (kind, subtype)
        for kind in ("WAV", "WAVEX", "RF64")
        for subtype in WIDTHS
        if soundfile.check_format(kind, subtype)
    ],
)
def test_a_wav_of_any_width_gives_its_samples(tmp_path, speech, kind, subtype):
    original = speech(16000)
    path = tmp_path / "a.wav"
    soundfile.write(path, original, 16000, format=kind, subtype=subtype)
    heard = read_audio(path)
    assert heard.sample_rate == 16000
    np.testing.assert_allclose(heard.samples[: len(original)], original, atol=WIDTHS[subtype])
    assert len(heard.samples) - len(original) < 1024  # ADPCM fills its last block


@pytest.mark.parametrize(
    ("name", "subtype"),
    [
        ("TIMIT.WAV", "NIST PCM_16"),
        ("a.flac", "PCM_S8"),
        ("a.flac", "PCM_16"),
        ("a.flac", "PCM_24"),
        ("a.aiff", "PCM_16"),
        ("a.caf", "PCM_16"),
        ("a.w64", "PCM_16"),
    ],
)
def test_other_lossless_files_give_their_samples(tmp_path, speech, name, subtype):
    original = speech(22050)
    *kind, subtype = subtype.split()
    soundfile.write(tmp_path / name, original, 22050, subtype=subtype, format=(*kind, None)[0])
    width = 2 / 256 if subtype == "PCM_S8" else 2 / 2**16
    np.testing.assert_allclose(read_audio(tmp_path / name).samples, original, atol=width)


@pytest.mark.parametrize("name", ["a.mp3", "a.ogg"])
def test_lossy_files_of_libsndfile_come_without_delay(tmp_path, speech, name, lag_and_likeness):
    original = speech(32000)
    with soundfile.SoundFile(tmp_path / name, "w", 32000, 1) as file:
        for start in range(0, len(original), 8000):
            file.write(original[start : start + 8000])
    heard = read_audio(tmp_path / name)
    lag, likeness = lag_and_likeness(heard.samples, original)
    assert (abs(lag), len(heard.samples)) == (0, len(original))
    assert likeness > 0.99


@pytest.mark.parametrize("rate", [4000, 8000, 11025, 22050, 44100, 96000, 192000, 384000])
def test_any_rate_is_brought_to_the_one_wanted(tmp_path, speech, rate, lag_and_likeness):
    original = speech(rate, 1.0)
    soundfile.write(tmp_path / "a.wav", original, rate, subtype="FLOAT")
    heard = read_audio(tmp_path / "a.wav", sample_rate=16000)
    assert heard.sample_rate == 16000
    lag, likeness = lag_and_likeness(heard.samples, speech(16000, 1.0))
    assert lag == 0
    assert likeness > (0.9 if rate < 16000 else 0.999)


@pytest.mark.parametrize("channels", [2, 3, 6, 40])
def test_channels_are_averaged_or_one_is_chosen(tmp_path, channels):
    sound = np.random.default_rng(1).uniform(-0.5, 0.5, (4000, channels)).astype(np.float32)
    soundfile.write(tmp_path / "a.wav", sound, 16000, subtype="FLOAT")
    mixed = read_audio(tmp_path / "a.wav").samples
    np.testing.assert_allclose(mixed, sound.mean(axis=1), atol=1e-6)
    last = read_audio(tmp_path / "a.wav", channel=channels - 1).samples
    np.testing.assert_array_equal(last, sound[:, -1])


def test_the_name_does_not_matter_only_the_content(tmp_path, speech, encode):
    original = speech(44100)
    encode(tmp_path / "a.m4a", original, 44100, "aac")
    for odd in ("speech", "a:b.wav", "ünï cödé 'x'.mp3", "http:x.m4a"):
        shutil.copy(tmp_path / "a.m4a", tmp_path / odd)
        assert read_audio(tmp_path / odd).duration_s == pytest.approx(3.0, abs=0.03)


@pytest.mark.parametrize("size", [0xFFFFFFFF, 0x7FFFF000, 0])
def test_a_wav_from_a_pipe_is_read_to_its_end(tmp_path, speech, size):
    original = speech(16000)
    path = tmp_path / "a.wav"
    soundfile.write(path, original, 16000, subtype="PCM_16")
    content = bytearray(path.read_bytes())
    content[4:8] = content[40:44] = size.to_bytes(4, "little")
    path.write_bytes(content)
    np.testing.assert_allclose(read_audio(path).samples, original, atol=2 / 2**16)


def test_chunks_around_the_sound_and_odd_padding_do_no_harm(tmp_path):
    sound = np.arange(-50, 51).astype(np.int8).view(np.uint8) + np.uint8(128)
    body = b"WAVE" + b"LIST" + (3).to_bytes(4, "little") + b"abc\0"
    body += b"fmt " + (16).to_bytes(4, "little") + bytes.fromhex("01000100401f0000401f000001000800")
    body += b"data" + len(sound).to_bytes(4, "little") + sound.tobytes() + b"\0"
    body += b"bext" + (4).to_bytes(4, "little") + b"abcd"
    (tmp_path / "a.wav").write_bytes(b"RIFF" + len(body).to_bytes(4, "little") + body)
    heard = read_audio(tmp_path / "a.wav")
    np.testing.assert_allclose(heard.samples * 128, np.arange(-50, 51))


def test_quiet_silent_clipped_and_over_full_scale_sound_is_left_as_it_is(tmp_path, speech):
    usual = speech(8000)
    for sound in (usual * 1e-4, usual * 0, np.clip(usual * 50, -1, 1), usual * 8):
        soundfile.write(tmp_path / "a.wav", sound, 8000, subtype="FLOAT")
        np.testing.assert_array_equal(read_audio(tmp_path / "a.wav").samples, sound)


@pytest.mark.shared_data
def test_the_sound_of_a_mpeg_film_is_that_of_its_sound_file(shared_data, lag_and_likeness):
    films = sorted((shared_data / "grid_s1" / "video").glob("*.mpg"))
    for film in films[:3]:
        original = read_audio(shared_data / "grid_s1" / "clips" / f"{film.stem}.ogg")
        heard = read_audio(film, sample_rate=original.sample_rate)
        lag, likeness = lag_and_likeness(heard.samples, original.samples)
        assert abs(lag) / original.sample_rate < 0.02
        assert likeness > 0.9  # MP2 at 44.1 kHz against Opus at 16 kHz


@pytest.mark.shared_data
def test_a_stored_recording_streams_in_blocks_of_the_length_asked_for(shared_data):
    path = next(iter(sorted((shared_data / "speech" / "ljspeech_a").rglob("*.og*"))))
    with open_audio(path) as stream:
        blocks = list(stream.blocks(0.5))
        assert {len(block) for block in blocks[:-1]} == {stream.sample_rate // 2}
        assert sum(map(len, blocks)) / stream.sample_rate == pytest.approx(stream.duration_s)


@pytest.mark.parametrize("rate", [16000, 44100, 48000])
@pytest.mark.parametrize("block_s", [0.013, 0.5, 7.0])
def test_chunks_of_any_length_give_bit_identical_samples(speech_wav, rate, block_s):
    whole = read_audio(speech_wav, sample_rate=rate).samples
    pieces = list(resampled_blocks(speech_wav, rate, block_s=block_s))
    np.testing.assert_array_equal(np.concatenate(pieces), whole)
    in_one, own_rate = soundfile.read(speech_wav, dtype="float32")
    np.testing.assert_array_equal(soxr.resample(in_one, own_rate, rate), whole)
