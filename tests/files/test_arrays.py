"""Arrays of others: what is promised is held against what is there."""

import io
import os
import pickle
import struct
import threading
import zipfile
from concurrent.futures import ThreadPoolExecutor
from dataclasses import replace

import numpy as np
import pytest

from elocute.errors import CorpusError, InputError, MotionError
from elocute.files.array_file import ArrayFile
from elocute.files.array_reading import npz_names, read_npy, read_npz
from elocute.files.array_writing import RowWriter, write_npz
from elocute.files.reading import ANY_BYTES, FileKind

NUMBERS = FileKind("numbers (.npz)", 10_000_000)


def npy_bytes(array):
    packed = io.BytesIO()
    np.save(packed, array)
    return packed.getvalue()


@pytest.mark.parametrize("compressed", [False, True])
def test_arrays_come_back_as_they_were(tmp_path, compressed):
    arrays = {
        "columns": np.asfortranarray(np.arange(6.0).reshape(2, 3)),
        "big": np.arange(4, dtype=">i4"),
        "truth": np.array([True, False]),
        "text": np.array("a word"),
        "empty": np.zeros((0, 3), np.float32),
        "one": np.float64(0.25),
    }
    write_npz(tmp_path / "a.npz", arrays, compressed=compressed)
    found = read_npz(tmp_path / "a.npz", NUMBERS)
    for name, array in arrays.items():
        np.testing.assert_array_equal(found[name], array)
    found["columns"][0, 0] = 9  # they are the caller's own
    assert set(read_npz(tmp_path / "a.npz", NUMBERS, only=frozenset({"big"}))) == {"big"}


@pytest.mark.parametrize(
    ("entry", "found"),
    [
        (npy_bytes(np.zeros(4))[:-8], "end early"),
        (npy_bytes(np.array([{"a": 1}], object)), "type '|O'"),
        (npy_bytes(np.zeros(2, [("a", "f4")])), "no plain type"),
        (npy_bytes(np.zeros(4)).replace(b"<f8", b",f8"), "type ',f8'"),
        (npy_bytes(np.zeros(4)).replace(b"(4,)", b"(-4,)"), "a shape that is none"),
        (npy_bytes(np.zeros(4)).replace(b"'shape': (4,)", b"'shape': f(4)"), "header"),
        (b"\x93NUMPY\x01\x00" + struct.pack("<H", 60_000) + b" " * 60_000, "a header of 60000"),
        (b"PK", "no NumPy array"),
        (b"version https://git-lfs.github.com/spec/v1\noid sha256:a\n", "a pointer of Git LFS"),
    ],
)
def test_an_entry_that_is_none_is_one_line(tmp_path, entry, found):
    with zipfile.ZipFile(tmp_path / "a.npz", "w") as archive:
        archive.writestr("weights.npy", entry)
    with pytest.raises(MotionError, match="weights") as caught:
        read_npz(tmp_path / "a.npz", replace(NUMBERS, error=MotionError))
    assert found in str(caught.value)
    assert "\n" not in str(caught.value)


def test_an_archive_that_unpacks_to_far_more_than_its_size_is_refused(tmp_path):
    with zipfile.ZipFile(tmp_path / "bomb.npz", "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr("zeros.npy", npy_bytes(np.zeros(20_000_000)))
    assert (tmp_path / "bomb.npz").stat().st_size < 200_000
    with pytest.raises(InputError, match="160 MB inside"):
        read_npz(tmp_path / "bomb.npz", NUMBERS)


def test_a_pipe_is_not_waited_for(tmp_path):
    if not hasattr(os, "mkfifo"):
        pytest.skip("this system has no named pipes")
    os.mkfifo(tmp_path / "pipe.npz")
    result = []

    def read():
        with pytest.raises(InputError, match="no regular file"):
            read_npz(tmp_path / "pipe.npz", NUMBERS)
        result.append("told")

    thread = threading.Thread(target=read, daemon=True)
    thread.start()
    thread.join(300)
    assert result == ["told"]


def test_a_larger_file_than_allowed_is_refused(tmp_path):
    np.save(tmp_path / "a.npy", np.zeros(1000))
    with pytest.raises(InputError, match=r"8.128 kB; allowed: numbers of up to 1 kB"):
        read_npy(tmp_path / "a.npy", FileKind("numbers", 1000))


@pytest.mark.skipif(np.finfo(np.longdouble).nmant != 63, reason="numbers of ten bytes are x86's")
def test_bits_that_are_no_number_of_ten_bytes_are_nan(tmp_path):
    """Found by the fuzzer: NumPy warns when it makes numbers of eight bytes of such."""
    numbers = np.array([1.5, 2, -3], np.longdouble)
    numbers.view(np.uint8)[16:26] = np.frombuffer(
        b"\x9a\x99\x99\x99\x99\x99\xb9?\x9a\x99", np.uint8
    )
    np.save(tmp_path / "a.npy", numbers)
    found = read_npy(tmp_path / "a.npy", FileKind("numbers", 1000))
    assert found.dtype == np.float64
    assert np.array_equal(found, [1.5, np.nan, -3], equal_nan=True)


def test_rows_of_a_file_are_read_as_a_memory_map_gives_them(tmp_path):
    array = np.random.default_rng(0).normal(size=(10, 4, 3)).astype(np.float32)
    np.save(tmp_path / "a.npy", array)
    rows = ArrayFile(tmp_path / "a.npy", NUMBERS)
    assert (rows.shape, rows.dtype, len(rows), rows.nbytes) == ((10, 4, 3), array.dtype, 10, 480)
    mask = np.arange(10) % 3 == 0
    for index in (
        3,
        -1,
        slice(2, 5),
        slice(None, None, 3),
        [7, 1],
        mask,
        (slice(1, 4), 2),
        (5, slice(1)),
        (2, 1, 0),
    ):
        np.testing.assert_array_equal(rows[index], array[index])
    np.testing.assert_array_equal(np.asarray(rows), array)
    with pytest.raises(IndexError):
        rows[10]


def test_a_file_cut_short_while_it_is_open_is_an_error_that_can_be_told(tmp_path):
    path = tmp_path / "frames.npy"
    np.save(path, np.zeros((1000, 300), np.float32))
    rows = ArrayFile(path, FileKind("frames", ANY_BYTES, CorpusError))
    rows[999]
    with path.open("r+b") as file:
        file.truncate(5000)
    with pytest.raises(CorpusError, match="cut short while it was read"):
        rows[999]


def test_rows_are_written_one_after_another_and_read_anywhere(tmp_path):
    numbers = np.arange(60, dtype=np.float32).reshape(20, 3)
    with RowWriter(tmp_path / "a.npy", (3,)) as rows:
        for start in range(0, 20, 7):
            rows.add(numbers[start : start + 7])
    assert (np.load(tmp_path / "a.npy") == numbers).all()
    file = ArrayFile(tmp_path / "a.npy", NUMBERS)
    places = np.array([3, 4, 5, 0, 19, 19, -1, 7])
    assert (file[places] == numbers[places]).all() and (file[[2, 9]] == numbers[[2, 9]]).all()
    assert file[np.zeros(0, int)].shape == (0, 3)
    with pytest.raises(IndexError):
        _ = file[[20]]


def test_a_part_is_an_array_of_its_own(tmp_path):
    numbers = np.arange(60, dtype=np.float32).reshape(20, 3)
    np.save(tmp_path / "a.npy", numbers)
    part = ArrayFile(tmp_path / "a.npy", NUMBERS).part(5, 12)
    assert part.shape == (7, 3) and (np.asarray(part) == numbers[5:12]).all()
    assert (part.part(1, 100)[-1] == numbers[11]).all()
    copy = pickle.loads(pickle.dumps(part))
    assert (copy[2:4] == numbers[7:9]).all()


def test_threads_may_read_one_file(tmp_path):
    numbers = np.arange(300_000, dtype=np.float32).reshape(1000, 300)
    np.save(tmp_path / "a.npy", numbers)
    file = ArrayFile(tmp_path / "a.npy", NUMBERS)
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(lambda row: file[row], [*range(1000)] * 4))
    assert (np.stack(found[:1000]) == numbers).all() and (found[3999] == numbers[-1]).all()


def test_a_header_with_escapes_is_refused_without_a_warning(tmp_path):
    header = rb"{'descr': '<f4\,', 'fortran_order': False, 'shape': (3,), }"
    data = b"\x93NUMPY\x01\x00" + len(header).to_bytes(2, "little") + header + bytes(12)
    (tmp_path / "a.npy").write_bytes(data)
    with pytest.raises(InputError, match="a header that cannot be read"):
        read_npy(tmp_path / "a.npy", FileKind("numbers", 1000))


def test_a_directory_of_millions_is_not_listed(tmp_path):
    """zipfile would make an object of half a kilobyte for each of its 53 bytes."""
    place = struct.pack("<HHHHHHIIIHHHHHII", 20, 20, 0, 0, 0, 33, 0, 0, 0, 7, 0, 0, 0, 0, 0, 0)
    entries = b"".join(b"PK\x01\x02" + place + b"%07d" % number for number in range(100_000))
    end = struct.pack("<HHHHIIH", 0, 0, 34464, 34464, len(entries), 0, 0)
    (tmp_path / "a.npz").write_bytes(entries + b"PK\x05\x06" + end)
    for read in (read_npz, npz_names):
        with pytest.raises(InputError, match="more than 10000 arrays"):
            read(tmp_path / "a.npz", NUMBERS)


def test_names_of_arrays(tmp_path):
    np.savez(tmp_path / "a.npz", one=np.ones(3), two=np.ones(2))
    names = npz_names(tmp_path / "a.npz", NUMBERS)
    assert names == {"one", "two"}


@pytest.mark.skipif(not hasattr(os, "SEEK_DATA"), reason="the system does not tell holes")
def test_a_file_of_holes_is_refused(tmp_path):
    """A few bytes that begin a terabyte."""
    path = tmp_path / "rows.npy"
    np.save(path, np.zeros((2, 3), "<f4"))
    header = path.read_bytes()[:128].replace(b"(2, 3)", b"(99999999999, 3)".ljust(6))
    with path.open("wb") as file:
        file.write(header)
        file.truncate(10**12)
    with pytest.raises(InputError, match=r"1000 GB, nearly all of it holes"):
        ArrayFile(path, FileKind("rows", ANY_BYTES))
