"""Whatever is wrong with a file is said in one line: which file, what was found, what to do."""

import os
import struct
from pathlib import Path

import numpy as np
import pytest
import soundfile

from elocute.audio import probe_audio, read as reading, read_audio
from elocute.errors import AudioError


def wav_header(
    rate: int, channels: int, data_bytes: int, *, width: int = 2, float_: bool = False
) -> bytes:
    frame = (channels * width) % 65536
    fmt = struct.pack(
        "<HHIIHH", 3 if float_ else 1, channels, rate, rate * frame % 2**32, frame, width * 8
    )
    riff = (36 + data_bytes) % 2**32
    return (
        b"RIFF"
        + struct.pack("<I", riff)
        + b"WAVE"
        + b"fmt "
        + struct.pack("<I", 16)
        + fmt
        + b"data"
        + struct.pack("<I", data_bytes)
    )


def floats(*values: float) -> bytes:
    sound = np.zeros(2000, "<f4")
    sound[500 : 500 + len(values)] = values
    return wav_header(8000, 1, sound.nbytes, width=4, float_=True) + sound.tobytes()


BAD_BYTES = {
    "empty": (b"", "an empty file", "export it again"),
    "no samples": (wav_header(16000, 1, 0), "0 samples", "at least 2"),
    "one sample": (wav_header(16000, 1, 2) + b"\0\1", "1 sample;", "at least 2"),
    "text": (b"This is what she said.\n" * 200, "no sound", "wav, flac, mp3"),
    "nothing but zeros": (bytes(5000), "no sound", "wav, flac, mp3"),
    "random": (np.random.default_rng(0).bytes(9000), "", "allowed"),
    "a playlist": (b"#EXTM3U\n#EXTINF:1,\n/etc/passwd\n", "no sound", "convert it"),
    "header alone": (wav_header(16000, 1, 32000), "0 of the 32000 bytes", "whole file"),
    "half a header": (wav_header(16000, 1, 32000)[:30], "no sound", "convert it"),
    "cut off": (wav_header(16000, 1, 32000) + bytes(9000), "9000 of the 32000", "cut off"),
    "no channels": (wav_header(16000, 0, 1000) + bytes(1000), "0 channels", "1 to 1024"),
    "65535 channels": (wav_header(16000, 65535, 1000) + bytes(1000), "65535 channels", "1 to 1024"),
    "rate 0": (wav_header(0, 1, 1000) + bytes(1000), "sample rate 0 Hz", "4000 to 768000"),
    "rate 1": (wav_header(1, 1, 1000) + bytes(1000), "sample rate 1 Hz", "4000 to 768000"),
    "rate 4e9": (wav_header(4_000_000_000, 1, 1000) + bytes(1000), "4000000000 Hz", "4000 to"),
    "NaN": (floats(np.nan), "NaN at sample 500 (0.062 s)", "finite samples within"),
    "infinity": (floats(0.5, -np.inf), "infinity at sample 501", "finite samples within"),
    "1e38": (floats(1e38), "value 1e+38 (largest 1e+38) at sample 500", "within ±100"),
    "integers as floats": (floats(900, 32767), "value 900 (largest 32767)", "full scale being ±1"),
}


def message_of(path: Path, **options) -> str:
    with pytest.raises(AudioError) as caught:
        read_audio(path, **options)
    text = str(caught.value)
    assert str(path) in text
    assert "allowed: " in text
    assert len(text.splitlines()) == 1
    return text


@pytest.mark.parametrize("name", BAD_BYTES)
@pytest.mark.parametrize("suffix", [".wav", ".mp3", ""])
def test_bytes_that_are_no_sound_are_refused(tmp_path, capfd, name, suffix):
    content, found, allowed_or_remedy = BAD_BYTES[name]
    path = tmp_path / f"speech{suffix}"
    path.write_bytes(content)
    text = message_of(path)
    assert found in text
    assert allowed_or_remedy in text
    assert capfd.readouterr() == ("", "")


def test_a_missing_file_and_a_folder_are_refused(tmp_path):
    assert "no such file" in message_of(tmp_path / "none.wav")
    assert "a folder" in message_of(tmp_path)


@pytest.mark.skipif(not hasattr(os, "mkfifo"), reason="this system has no named pipes")
def test_a_pipe_is_refused_and_not_waited_for(tmp_path):
    os.mkfifo(tmp_path / "a.wav")
    assert "no regular file" in message_of(tmp_path / "a.wav")


def test_a_name_that_the_system_refuses_is_refused(tmp_path):
    assert "cannot be read (" in message_of(tmp_path / ("a" * 300 + ".wav"))


@pytest.mark.skipif(
    not hasattr(os, "geteuid") or os.geteuid() == 0, reason="this user may read every file"
)
def test_a_file_that_may_not_be_read_is_refused(tmp_path):
    path = tmp_path / "a.wav"
    path.write_bytes(floats())
    path.chmod(0)
    assert "cannot be read" in message_of(path)


@pytest.mark.parametrize("channel", [-1, 2, 7])
def test_a_channel_that_is_not_there_is_refused(tmp_path, channel):
    soundfile.write(tmp_path / "a.wav", np.zeros((100, 2)), 16000)
    assert f"no channel {channel}; allowed: 0 to 1" in message_of(
        tmp_path / "a.wav", channel=channel
    )


def test_damage_in_a_channel_that_is_not_chosen_does_no_harm(tmp_path):
    sound = np.zeros((100, 2), np.float32)
    sound[7, 1] = np.nan
    soundfile.write(tmp_path / "a.wav", sound, 16000, subtype="FLOAT")
    assert len(read_audio(tmp_path / "a.wav", channel=0).samples) == 100
    assert "NaN at sample 7" in message_of(tmp_path / "a.wav")


CUT = [
    ("a.flac", None, None),
    ("a.ogg", None, None),
    ("a.aiff", None, None),
    ("a.w64", None, None),
    ("a.caf", None, None),
    ("a.au", None, None),
    ("a.nist", None, None),
    ("a.m4a", "aac", {}),
    ("a.m4a", "aac", {"movflags": "faststart"}),
    ("a.opus", "libopus", {}),
    ("a.mkv", "libopus", {}),
    ("a.webm", "libopus", {}),
    ("xing.mp3", "libmp3lame", {}),
]


@pytest.mark.parametrize(("name", "codec", "options"), CUT)
@pytest.mark.parametrize("share", [0.5, 0.9])
def test_a_file_that_was_cut_off_is_refused(
    tmp_path, speech, encode, capfd, name, codec, options, share
):
    path = tmp_path / name
    if codec:
        encode(path, speech(48000), 48000, codec, options=options)
    else:
        soundfile.write(path, speech(48000), 48000)
    whole = read_audio(path).duration_s
    assert whole == pytest.approx(3, abs=0.03)
    content = path.read_bytes()
    path.write_bytes(content[: int(len(content) * share)])
    assert "a whole file" in message_of(path)
    assert capfd.readouterr() == ("", "")


def test_a_chunk_longer_than_any_file_is_refused(tmp_path, speech):
    soundfile.write(tmp_path / "a.caf", speech(16000), 16000)
    content = bytearray((tmp_path / "a.caf").read_bytes())
    content[content.index(b"desc") + 4] = 0x80  # the highest of the eight bytes of its size
    (tmp_path / "a.caf").write_bytes(content)
    assert "no sound that can be read" in message_of(tmp_path / "a.caf")


def test_a_cut_off_rf64_file_is_refused(tmp_path, speech):
    soundfile.write(tmp_path / "a.wav", speech(16000), 16000, format="RF64", subtype="PCM_16")
    content = (tmp_path / "a.wav").read_bytes()
    (tmp_path / "a.wav").write_bytes(content[:-100])
    assert "95900 of the 96000 bytes of sound promised: it was cut off" in message_of(
        tmp_path / "a.wav"
    )


@pytest.mark.parametrize("name", ["a.mp4", "a.mkv", "a.avi"])
def test_a_film_without_sound_is_refused(tmp_path, silent_film, name):
    assert "no audio track" in message_of(silent_film(tmp_path / name))


def test_damage_within_a_flac_file_is_refused(tmp_path, speech):
    soundfile.write(tmp_path / "a.flac", speech(16000), 16000)
    content = bytearray((tmp_path / "a.flac").read_bytes())
    middle = len(content) // 2
    content[middle : middle + 400] = bytes(400)
    (tmp_path / "a.flac").write_bytes(content)
    assert "a whole file" in message_of(tmp_path / "a.flac")


def test_more_than_a_day_is_refused_from_the_header(tmp_path):
    path = tmp_path / "a.wav"
    path.write_bytes(wav_header(8000, 1, 25 * 3600 * 8000, width=1))
    with path.open("r+b") as file:
        file.truncate(44 + 25 * 3600 * 8000)  # sparse: takes no room
    with pytest.raises(AudioError, match=r"25\.0 hours; allowed: 24 hours"):
        probe_audio(path)


def test_a_flac_header_that_promises_years_takes_no_memory(tmp_path):
    path = tmp_path / "a.flac"
    soundfile.write(path, np.zeros(8000), 8000)
    content = bytearray(path.read_bytes())
    content[21] |= 0x0F  # the upper bits of the number of samples
    content[22:26] = b"\xff" * 4
    path.write_bytes(content)
    assert "hours; allowed: 24 hours" in message_of(path)


def test_more_than_a_day_is_refused_while_it_streams(tmp_path, speech, encode, monkeypatch):
    # A live recording does not say how long it is; the day is a second here.
    path = encode(tmp_path / "a.webm", speech(48000), 48000, "libopus", options={"live": "1"})
    assert probe_audio(path).duration_s is None
    monkeypatch.setattr(reading, "DURATION_MAX_S", 1.0)
    assert "allowed: 24 hours" in message_of(path)


@pytest.mark.parametrize("rate", [0, 1, 3999, 4e9, 16000.5, float("nan"), float("inf")])
def test_an_absurd_rate_to_resample_to_is_refused(speech_wav, rate):
    with pytest.raises(AudioError, match=r"allowed: 4000 to 768000 Hz"):
        read_audio(speech_wav, sample_rate=rate)


def test_nothing_is_decoded_to_probe_a_file(tmp_path):
    # Sound that would be refused when decoded: the header alone is fine.
    (tmp_path / "a.wav").write_bytes(floats(np.nan))
    assert probe_audio(tmp_path / "a.wav").duration_s == 0.25


@pytest.mark.skipif(not hasattr(os, "SEEK_DATA"), reason="the system does not tell holes")
def test_silence_that_is_not_stored_takes_no_memory(tmp_path):
    """Sixteen hours of a wav are a hole; they would be 3.7 GB in memory."""
    path = tmp_path / "a.wav"
    path.write_bytes(wav_header(16000, 1, 900_000_000, width=1))
    with path.open("r+b") as file:
        file.truncate(44 + 900_000_000)
    assert "more than 104 minutes of sound" in message_of(path)
