"""Sound as pipes, recorders and editors leave it: unknown sizes, odd chunks, tags, tracks."""

from __future__ import annotations

import io
import struct

import numpy as np
import pytest
import soundfile

from elocute.audio.read import open_audio, probe_audio, read_audio
from elocute.audio.speech_input import resolve_speech
from elocute.audio.waveform import Waveform
from elocute.errors import AudioError

RATE = 16000
TONE = np.round(np.sin(np.arange(RATE) / 9) * 8000).astype(np.int16)

PCM = TONE.tobytes()


def chunk(name, content, size=None, padded=True):
    pad = b"\0" if padded and len(content) % 2 else b""
    return name + struct.pack("<I", len(content) if size is None else size) + content + pad


def wav(*before, data=PCM, size=None, riff=None, channels=1, behind=b""):
    fmt = struct.pack("<HHIIHH", 1, channels, RATE, 2 * channels * RATE, 2 * channels, 16)
    body = b"WAVE" + chunk(b"fmt ", fmt) + b"".join(before) + chunk(b"data", data, size) + behind
    return b"RIFF" + struct.pack("<I", len(body) if riff is None else riff) + body


@pytest.fixture
def given(tmp_path):
    def write(data, name="s.wav"):
        path = tmp_path / name
        path.write_bytes(data)
        return path

    return write


def samples(path, **choice):
    with open_audio(path, **choice) as stream:
        return np.concatenate(list(stream.blocks())), stream.notes


@pytest.mark.parametrize(
    "size", [0x7FFF0000, 0x7FFFFF00, 0x7FFFFFFF, 0x80000000, 0x7FFFF000, 0xFFFFFFFF, 0xFFFFFFFE]
)
@pytest.mark.parametrize("through", ["a file", "bytes", "an open file"])
def test_a_size_that_no_file_has_is_the_rest_of_the_file(given, size, through):
    data = wav(size=size, riff=min(size + 36, 0xFFFFFFFF))
    if through == "a file":
        assert probe_audio(given(data)).duration_s == 1.0
        found, notes = samples(given(data))
        assert notes == []
    else:
        sound = resolve_speech(data if through == "bytes" else io.BytesIO(data))
        assert isinstance(sound, Waveform)
        found = sound.samples
    assert np.array_equal(found, TONE / np.float32(32768))


def test_a_size_that_a_file_may_have_is_believed(given):
    with pytest.raises(AudioError, match=r"32000 of the 2147418111 bytes .* it was cut off"):
        read_audio(given(wav(size=0x7FFEFFFF)))


@pytest.mark.parametrize("name", [b"LIST", b"bext", b"junk", b"iXML"])
@pytest.mark.parametrize("padded", [True, False])
def test_odd_chunks_with_padding_or_without(given, name, padded):
    content = b"INFOISFT" + struct.pack("<I", 5) + b"Lavf\0" if name == b"LIST" else b"x" * 13
    found, _ = samples(given(wav(chunk(name, content, padded=padded))))
    assert np.array_equal(found, TONE / np.float32(32768))


def test_a_tag_before_riff_is_passed_over(given):
    tag = b"ID3\x03\0\0" + bytes([0, 0, 2, 0]) + bytes(256)
    for data in (wav(), wav(size=0x7FFFFFFF), wav(chunk(b"LIST", b"x" * 13, padded=False))):
        found, _ = samples(given(tag + data))
        assert np.array_equal(found, TONE / np.float32(32768))


def test_what_was_cut_off_is_read_on_request(given):
    path = given(wav()[:-12000])
    with pytest.raises(AudioError, match=r"20000 of the 32000 .* what is there with `partial`"):
        samples(path)
    found, notes = samples(path, partial=True)
    assert np.array_equal(found, TONE[:10000] / np.float32(32768))
    assert notes == ["cut off: 0.62 of 1.00 s are there"]
    whole = resolve_speech(path, partial=True, notes=notes)
    assert isinstance(whole, Waveform) and len(whole.samples) == 10000 and len(notes) == 2
    assert samples(given(wav()), partial=True)[1] == []


@pytest.mark.parametrize("kind", ["flac", "aiff", "ogg"])
def test_other_files_that_were_cut_off_as_well(given, tmp_path, kind):
    noise = np.random.default_rng(1).normal(0, 0.1, 5 * RATE)
    soundfile.write(tmp_path / f"whole.{kind}", noise, RATE)
    data = (tmp_path / f"whole.{kind}").read_bytes()
    path = given(data[: len(data) * 3 // 5], f"s.{kind}")
    with pytest.raises(AudioError):
        samples(path)
    found, _ = samples(path, partial=True)
    assert 2 * RATE < len(found) < 4 * RATE


def test_channels_that_cancel_each_other_are_not_mixed(given):
    louder = np.stack([TONE, -TONE // 2 * 2], axis=1)
    louder[:, 0] //= 2
    inverted = np.stack([TONE, -TONE], axis=1)
    found, notes = samples(given(wav(data=inverted.tobytes(), channels=2)))
    assert np.abs(found).max() > 0.2 and "its channels cancel each other" in notes[0]
    apart = np.stack([TONE, np.roll(TONE, 4000)], axis=1)
    for other in (np.stack([TONE, TONE], axis=1), apart, np.stack([TONE, 0 * TONE], axis=1)):
        found, notes = samples(given(wav(data=other.tobytes(), channels=2)))
        assert notes == [] and np.allclose(found, other.mean(axis=1) / 32768, atol=1e-6)
    chosen, notes = samples(given(wav(data=inverted.tobytes(), channels=2)), channel=1)
    assert notes == [] and np.array_equal(chosen, -TONE / np.float32(32768))
    told: list[str] = []
    sound = resolve_speech(inverted / 32768, 16000, notes=told)
    assert isinstance(sound, Waveform) and np.abs(sound.samples).max() > 0.2 and len(told) == 1
    # A mix that is half as loud is none that cancels.
    assert samples(given(wav(data=louder.tobytes(), channels=2)))[1] == []


@pytest.fixture(scope="module")
def two_tracks(tmp_path_factory):
    """A film whose first track is silent."""
    import av

    path = tmp_path_factory.mktemp("tracks") / "film.mkv"
    with av.open(str(path), "w") as file:
        streams = [file.add_stream("pcm_s16le", rate=RATE, layout="mono") for _ in range(2)]
        streams[1].metadata["language"] = "deu"
        for stream, sound in zip(streams, (np.zeros_like(TONE), TONE), strict=True):
            frame = av.AudioFrame.from_ndarray(sound[None], format="s16", layout="mono")
            frame.sample_rate, frame.pts = RATE, 0
            file.mux(stream.encode(frame))
            file.mux(stream.encode(None))
    return path


def test_of_several_tracks_one_is_chosen(two_tracks):
    tracks = probe_audio(two_tracks).tracks
    assert tracks == ("pcm_s16le, 16000 Hz, 1 channel", "pcm_s16le, 16000 Hz, 1 channel (deu)")
    found, notes = samples(two_tracks)
    assert not found.any()
    assert notes == ["of 2 audio tracks the first is taken: `track` takes another"]
    found, notes = samples(two_tracks, track=0)
    assert not found.any() and not notes
    assert np.array_equal(samples(two_tracks, track=1)[0], TONE / np.float32(32768))
    for track in (2, -1, "1"):
        with pytest.raises(AudioError, match=r"no track .*; allowed: 0 to 1; `elocute info`"):
            samples(two_tracks, track=track)


def test_a_file_with_one_track_has_no_other(given):
    path = given(wav())
    assert probe_audio(path).tracks == () and len(samples(path, track=0)[0]) == RATE
    with pytest.raises(AudioError, match="no track 1; allowed: 0, the only one"):
        samples(path, track=1)


def test_files_behind_the_first_are_told(given):
    """Streams of speech engines whose every part has a header, written one after another."""
    found, notes = samples(given(wav() * 3))
    assert np.array_equal(found, TONE / np.float32(32768))
    assert notes == [
        "WAVE parts behind the first, 2, are left out: join their sounds, not the files"
    ]
    assert samples(given(wav(chunk(b"LIST", b"INFO"))))[1] == []
    assert samples(given(wav() + chunk(b"data", bytes(2000))))[1][0].startswith("WAVE parts behind")


@pytest.mark.parametrize("kind", ["ogg", "mp3"])
def test_files_that_were_joined_are_read_to_the_end(given, tmp_path, encode, kind):
    """As `cat` joins the answers of speech engines."""
    parts = []
    for number, level in enumerate((0.1, 0.5)):
        tone = np.float32(level) * TONE / np.float32(TONE.max())
        path = tmp_path / f"{number}.{kind}"
        if kind == "mp3":
            encode(path, tone, RATE, "libmp3lame")
        else:
            soundfile.write(path, tone, RATE)
        parts.append(path.read_bytes())
        assert samples(path)[1] == []
    found, notes = samples(given(b"".join(parts), f"s.{kind}"))
    assert len(found) == pytest.approx(2 * RATE, abs=0.15 * RATE)
    assert np.abs(found[: RATE * 3 // 4]).max() < 0.2 < 0.4 < np.abs(found[RATE * 5 // 4 :]).max()
    assert len(notes) == 1 and notes[0].startswith("several files, one behind the other")
    if kind == "ogg":
        assert probe_audio(tmp_path / "s.ogg").duration_s is None


def test_flac_files_behind_the_first_are_told(given, tmp_path):
    soundfile.write(tmp_path / "whole.flac", TONE, RATE)
    found, notes = samples(given((tmp_path / "whole.flac").read_bytes() * 2, "s.flac"))
    assert len(found) == RATE
    assert notes[0].startswith("FLAC parts behind the first, one or more, are left out")


def test_a_wav_whose_numbers_are_the_other_way_round(given, tmp_path):
    soundfile.write(tmp_path / "s.wav", TONE, RATE, endian="BIG")
    data = (tmp_path / "s.wav").read_bytes()
    assert data.startswith(b"RIFX")
    assert np.array_equal(samples(given(data))[0], TONE / np.float32(32768))
    with pytest.raises(AudioError, match="cut off"):
        samples(given(data[: len(data) // 2]))
