"""Sound files made to hurt: each is read as what it is, or refused in one line, and soon."""

import struct
from pathlib import Path

import av
import numpy as np
import pytest
import soundfile

from elocute.audio import read as reading, read_audio
from elocute.errors import AudioError

TONE = (0.3 * np.sin(np.arange(8000) / 9)).astype(np.float32)


def refusal(path: Path) -> str:
    with pytest.raises(AudioError) as caught:
        read_audio(path)
    text = str(caught.value)
    assert len(text.splitlines()) == 1
    return text


def chunk(name: bytes, content: bytes, size: int | None = None) -> bytes:
    return name + struct.pack("<I", len(content) if size is None else size) + content


def wav(*chunks: bytes, tag: int = 1, kind: bytes = b"RIFF") -> bytes:
    fmt = chunk(b"fmt ", struct.pack("<HHIIHH", tag, 1, 16000, 32000, 2, 16))
    sound = chunk(b"data", (TONE * 32767).astype("<i2").tobytes())
    content = b"WAVE" + fmt + b"".join(chunks) + sound
    return chunk(kind, content)


@pytest.mark.parametrize("size", [0xFFFFFFF8, 0xFFFFFFF4, 0x80000000, 1000])
@pytest.mark.parametrize("before", [True, False])
def test_a_list_whose_parts_lead_backwards_ends(tmp_path, size, before):
    """libsndfile 1.2.2 never comes back from such a list (its issue 1118)."""
    part = chunk(b"LIST", b"INFO" + chunk(b"ICMT", b"abcdefgh" * 3, size))
    content = wav(part) if before else chunk(b"RIFF", wav()[8:] + part)
    (tmp_path / "a.wav").write_bytes(content)
    assert len(read_audio(tmp_path / "a.wav").samples) == len(TONE)


@pytest.mark.parametrize("tag", [0x1234, 0xFFFF, 0xABCD])
def test_a_coding_that_nobody_knows_is_refused(tmp_path, tag):
    (tmp_path / "a.wav").write_bytes(wav(tag=tag))
    assert "in a codec that FFmpeg does not support" in refusal(tmp_path / "a.wav")


def test_long_sizes_that_end_early_are_refused(tmp_path):
    content = wav(kind=b"RF64")[:12] + chunk(b"ds64", b"1234567", 28)
    (tmp_path / "a.wav").write_bytes(content)
    assert "allowed: " in refusal(tmp_path / "a.wav")


def test_sixteen_channels_in_a_container_are_averaged(tmp_path):
    samples = np.random.default_rng(0).uniform(-0.1, 0.1, (4800, 16)).astype(np.float32)
    with av.open(str(tmp_path / "a.mkv"), "w") as container:
        stream = container.add_stream("pcm_f32le", rate=48000, layout="hexadecagonal")
        frame = av.AudioFrame.from_ndarray(samples.reshape(1, -1), "flt", "hexadecagonal")
        frame.sample_rate = 48000
        container.mux(stream.encode(frame))
        container.mux(stream.encode(None))
    assert np.allclose(read_audio(tmp_path / "a.mkv").samples, samples.mean(axis=1), atol=1e-6)


def test_hours_of_silence_before_the_sound_are_refused(tmp_path, speech, encode):
    path = encode(
        tmp_path / "a.mkv", speech(48000, 0.5), 48000, "libopus", picture="libx264", start_s=7200.0
    )
    assert "begins after 7200 s of nothing; allowed: 600 s" in refusal(path)


@pytest.mark.parametrize("told", ["1e308:0:0", "inf:0:0", "nan:0:0", "9" * 400 + ":0:0", "a:b"])
def test_a_length_that_is_no_number_is_not_believed(tmp_path, speech, encode, told):
    path = encode(tmp_path / "a.mkv", speech(48000, 1.0), 48000, "libopus")
    content = path.read_bytes()
    at = content.index(b"00:00:01")
    path.write_bytes(content[:at] + told.encode()[:16].ljust(16) + content[at + 16 :])
    assert len(read_audio(path).samples) == pytest.approx(48000, abs=1000)


def test_a_whole_sound_takes_no_more_memory_than_allowed(tmp_path, monkeypatch):
    soundfile.write(tmp_path / "a.flac", np.zeros(16000 * 600), 16000)
    monkeypatch.setattr(reading, "WHOLE_MAX_BYTES", 4 * 16000 * 60)
    assert "cut it into parts" in refusal(tmp_path / "a.flac")


def test_a_film_does_not_open_the_file_that_its_sound_is_said_to_be_in(tmp_path, encode):
    """QuickTime tracks may name another file that holds their sound."""
    path = encode(tmp_path / "a.mov", TONE, 16000, "pcm_s16le")
    outside = tmp_path / "outside.raw"
    outside.write_bytes(np.full(100_000, 9999, "<i2").tobytes())
    own = path.read_bytes()
    path.write_bytes(with_reference(own, outside))
    assert path.read_bytes().count(str(outside).encode()) == 1
    try:
        heard = read_audio(path).samples
    except AudioError as error:
        assert len(str(error).splitlines()) == 1
    else:
        assert np.allclose(heard, TONE, atol=1e-3)


def with_reference(content: bytes, outside: Path) -> bytes:
    """A .mov (index last) whose one track says that its sound is in another file: an alias."""
    told = str(outside).encode()
    alias = bytes(6) + b"\0\2" + bytes(2)  # record size, version
    alias += bytes([0]) + bytes(27) + bytes(12) + bytes([len(outside.name)])
    alias += outside.name.encode().ljust(63, b"\0") + bytes(16) + struct.pack(">hh", 1, 1)
    alias += bytes(16) + struct.pack(">HH", 2, len(told)) + told + bytes(len(told) % 2)
    alias += struct.pack(">hH", -1, 0)
    entry = struct.pack(">I", len(alias) + 12) + b"alis" + bytes(4) + alias
    table = bytes(4) + struct.pack(">I", 1) + entry
    return _replaced(content, [b"moov", b"trak", b"mdia", b"minf", b"dinf", b"dref"], table)


def _replaced(boxes: bytes, names: list[bytes], content: bytes) -> bytes:
    """`boxes` with the content of the one that `names` lead to replaced."""
    at, out = 0, b""
    while at < len(boxes):
        size, name = struct.unpack(">I4s", boxes[at : at + 8])
        inner = boxes[at + 8 : at + size]
        if name == names[0]:
            inner = _replaced(inner, names[1:], content) if names[1:] else content
        out += struct.pack(">I4s", len(inner) + 8, name) + inner
        at += size
    return out
