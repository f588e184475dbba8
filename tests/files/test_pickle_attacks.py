"""Small pickles that cost a great deal: each is refused within ten seconds and a gigabyte."""

import struct

import numpy as np
import pytest

from tests.support.commands import run_python

pytest.importorskip("resource", reason="limits of memory are those of POSIX")

READ = """
import resource, sys
from elocute.errors import InputError
from elocute.files.pickles.closed_pickle import read_pickle
resource.setrlimit(resource.RLIMIT_AS, (1_000_000_000, 1_000_000_000))
resource.setrlimit(resource.RLIMIT_CPU, (10, 10))  # of its own: the machine may be busy
try:
    read_pickle(sys.argv[1])
except InputError as error:
    print(error)
"""


def long_text(data):
    return b"X" + struct.pack("<I", len(data)) + data


def array(dtype, raw, count):
    """An array as protocol 0 spells it; `raw` are opcodes that leave its bytes on the stack."""
    return (
        b"cnumpy.core.multiarray\n_reconstruct\n(cnumpy\nndarray\n(I0\ntS'b'\ntR(I1\n"
        b"(I%d\ntcnumpy\ndtype\n(S'%s'\nI0\nI1\ntR(I3\nS'|'\nNNNI-1\nI-1\nI0\ntbI00\n%stb"
        % (count, dtype, raw)
    )


def nested(opcode):
    """Containers of two each, which hold the same one twice: 2^40 at the bottom."""
    return b"N" + b"p0\n0(g0\ng0\n" + opcode + b"p0\n0(g0\ng0\n".join([opcode] * 39)


MERSENNE = 2**61 - 1  # Python hashes a whole number as its remainder by this


def long_integer(value):
    return b"\x8a\x10" + value.to_bytes(16, "little")


# Made when it is their turn: together they are some hundred megabytes.
COLLIDING = b"}(" + b"".join(long_integer(k * MERSENNE) + b"N" for k in range(1, 60_000)) + b"u."
ATTACKS = {
    "lists that hold one list twice, forty deep": lambda: nested(b"l") + b".",
    "tuples of that kind": lambda: nested(b"t") + b".",
    "a name that is such a list": lambda: b"\x80\x04" + nested(b"l") + b"\x8c\x01a\x93.",
    "a list that holds itself": lambda: b"]p0\ng0\na.",
    "keys that all hash alike": lambda: COLLIDING,
    "keys that all fall into one place": lambda: (
        b"}("
        + b"".join(b"\x8a\x08" + struct.pack("<q", k << 40) + b"N" for k in range(60_000))
        + b"u."
    ),
    "memo entries that all hash alike": lambda: (
        b"N" + b"".join(b"p%d\n" % (k * MERSENNE) for k in range(1, 60_000)) + b"."
    ),
    "equal keys of a megabyte": lambda: (
        b"}p0\n0"
        + (long_text(b"k" * 10**6) + b"p1\n0" + long_text(b"k" * 10**6) + b"p2\n0")
        + b"g0\ng1\nNs"
        + b"g2\nNs" * 300_000
        + b"."
    ),
    "truth values looked through again and again": lambda: (
        b"T"
        + struct.pack("<i", 10**7)
        + bytes(10**7)
        + b"p0\n0"
        + (array(b"b1", b"g0\n", 10**7) + b"0") * 20_000
        + b"N."
    ),
    "one text encoded again and again": lambda: (
        long_text(b"a" * 10**7) + b"p0\n0]" + b"c_codecs\nencode\n(g0\nS'latin1'\ntRa" * 300 + b"."
    ),
    "texts with one wide character": lambda: (
        b"]" + (long_text(b"a" * 10**7 + "😀".encode()) + b"a") * 20 + b"."
    ),
    "a million empty sets": lambda: b"\x80\x04](" + b"\x8f" * 2_000_000 + b"e.",
    "one array under many names": lambda: (
        b"T"
        + struct.pack("<i", 4 * 10**6)
        + bytes(4 * 10**6)
        + b"p0\n0"
        + array(b"f4", b"g0\n", 10**6)
        + b"p1\n0}("
        + b"".join(b"S'%d'\ng1\n" % k for k in range(100_000))
        + b"u."
    ),
    "tuples three million deep": lambda: b"N" + b"\x85" * 3_000_000 + b".",
    "nothing, six million times": lambda: b"N0" * 3_000_000 + b"N.",
}


@pytest.mark.usefixtures("unmeasured")
@pytest.mark.parametrize("name", ATTACKS)
def test_an_attack_is_refused_in_one_line_and_little_time(name, tmp_path):
    path = tmp_path / "attack.pkl"
    path.write_bytes(ATTACKS[name]())
    done = run_python("-c", READ, path, timeout=120)
    assert done.returncode == 0 and not done.stderr, done.stderr[-500:]
    (line,) = done.stdout.splitlines()
    assert line.startswith(f"{path}: ") and len(line) < 400 + len(str(path))


def test_keys_as_real_files_have_them_are_read(tmp_path):
    import pickle

    from elocute.files.pickles.closed_pickle import read_pickle

    rows = {"subject": {"sentence01": {frame: 1000 + frame for frame in range(120_000)}}}
    path = tmp_path / "subj_seq_to_idx.pkl"
    path.write_bytes(pickle.dumps(rows, 2))
    assert read_pickle(path) == rows
    shared = np.zeros((5023, 3))
    path.write_bytes(pickle.dumps({"a": shared, "b": shared}, 2))
    assert set(read_pickle(path)) == {"a", "b"}


HEAPS = {
    "lists in a list": lambda: b"](" + b"]" * 2_000_000 + b"e.",
    "lists within lists": lambda: b"]" * 600_000 + b"a" * 599_999 + b".",
    "lists of one": lambda: b"](" + b"]Na" * 650_000 + b"e.",
    "tuples within tuples": lambda: b"N" + b"\x85" * 2_000_000 + b".",
    "dicts in a list": lambda: b"](" + b"}" * 2_000_000 + b"e.",
    "sets in a list": lambda: b"\x80\x04](" + b"\x8f" * 2_000_000 + b"e.",
}
PEAK = """
import resource, sys
from elocute.errors import InputError
from elocute.files.pickles.closed_pickle import read_pickle
before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
try:
    read_pickle(sys.argv[1])
except InputError:
    pass
print(resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before)
"""


@pytest.mark.parametrize("name", HEAPS)
def test_containers_take_a_hundred_times_the_file_at_most(name, tmp_path):
    path = tmp_path / "heap.pkl"
    path.write_bytes(HEAPS[name]())
    done = run_python("-c", PEAK, path, check=True, timeout=120)
    assert int(done.stdout) * 1024 <= 100 * path.stat().st_size, done.stdout
