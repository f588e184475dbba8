"""The closed unpickler: what it reads, and that it runs nothing."""

import collections
import os
import pickle
import pickletools
import struct
import time

import numpy as np
import pytest
from scipy.sparse import csc_matrix, csr_matrix

from elocute.errors import InputError
from elocute.files.pickles.closed_pickle import SparseMatrix, read_pickle
from elocute.files.pickles.pickle_cursor import Cursor

PROTOCOLS = range(pickle.HIGHEST_PROTOCOL + 1)


@pytest.fixture
def read(tmp_path):
    """Read these bytes as a file."""

    def read_bytes(data, **options):
        path = tmp_path / "file.pkl"
        path.write_bytes(data)
        return read_pickle(path, **options)

    return read_bytes


@pytest.fixture
def refused(read):
    """These bytes are refused in one line that holds these words."""

    def refuse(data, *words, **options):
        with pytest.raises(InputError) as caught:
            read(data, **options)
        message = str(caught.value)
        assert "\n" not in message and "file.pkl: " in message
        for word in words:
            assert word in message, message
        return message

    return refuse


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_plain_data(read, protocol):
    data = {
        "numbers": [0, -1, 255, 70_000, -(2**40), 2**70, 0.5, float("inf"), True, False, None],
        "texts": ["", "plain", "hé\n'\"\\", "\u4e2d" * 300, b"", b"\x00\xff", b"\xfe" * 300],
        "tuples": ((), (1,), (1, 2), (1, 2, 3), tuple(range(20)), (b"x" * 300, (b"y" * 300,))),
        "set": {1, "a"},
        "ordered": collections.OrderedDict(b=1, a=[2]),
        3: {"nested": [[[]]]},
    }
    assert read(pickle.dumps(data, protocol)) == data


@pytest.mark.parametrize("protocol", PROTOCOLS)
@pytest.mark.parametrize("dtype", ["?", "i1", "<i2", ">i4", "u8", "f2", "<f4", ">f8"])
def test_arrays_of_numbers(read, protocol, dtype):
    array = np.arange(24).reshape(2, 3, 4).astype(dtype)
    data = {"c": array, "f": np.asfortranarray(array), "none": array[:0], "one": array[0, 0, 1]}
    back = read(pickle.dumps(data, protocol))
    for name, value in data.items():
        assert np.array_equal(back[name], value) and back[name].dtype == value.dtype


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_sparse_matrices(read, protocol):
    dense = np.array([[0, 2.0, 0], [1, 0, 3]])
    columns, rows = read(pickle.dumps([csc_matrix(dense), csr_matrix(dense)], protocol))
    assert isinstance(columns, SparseMatrix) and (columns.layout, rows.layout) == ("csc", "csr")
    assert np.array_equal(columns.dense(), dense) and np.array_equal(rows.dense(), dense)


@pytest.mark.parametrize("protocol", [0, 1, 2])
def test_chumpy_objects_of_python_2_become_their_arrays(read, python2, protocol):
    array = np.arange(200.0).reshape(50, 4)
    inner = python2.Ch(x=array, _dirty_vars={"x"}, _status="new", _itr=None)
    chosen = python2.Select(a=inner, idxs=np.array([5, 0, 7, 2]), preferred_shape=(2, 2))
    back = read(python2.dumps({"x": inner, "again": [inner], "chosen": chosen}, protocol))
    assert np.array_equal(back["x"], array)
    assert back["again"][0] is back["x"]
    assert np.array_equal(back["chosen"], [[5, 0], [7, 2]])


@pytest.mark.parametrize("protocol", PROTOCOLS)
def test_opcodes_are_those_that_pickletools_sees(protocol):
    data = [1, 2**40, 0.5, "é" * 300, b"x" * 300, (True, None), np.arange(9), {"a": {1}}]
    pickled = pickle.dumps(data, protocol)
    cursor, seen = Cursor(pickled), []
    while not seen or seen[-1] != "STOP":
        seen.append(cursor.opcode())
        cursor.argument()
    assert seen == [opcode.name for opcode, _, _ in pickletools.genops(pickled)]


def test_texts_of_python_2_are_latin_1(read, python2):
    assert read(python2.dumps({"café": "é" * 300})) == {"café": "é" * 300}
    assert read(b"S'a\\xe9\\n\\\\d\\''\n.") == "aé\n\\d'"
    assert read(b"I01\n.") is True and read(b"L7L\n.") == 7


def test_arrays_are_views_that_nobody_can_write(read):
    array = read(pickle.dumps(np.arange(1000.0), 2 + 2))
    assert not array.flags.writeable and not array.flags.owndata


def test_a_corpus_of_sound_is_read_at_the_speed_of_the_disk(tmp_path, python2):
    rng = np.random.default_rng(0)
    sound = rng.integers(-9999, 9999, 80_000).astype(np.int16)
    corpus = {
        f"subject{s}": {
            f"sentence{n:02d}": {"audio": sound + n, "sample_rate": 22050} for n in range(40)
        }
        for s in range(8)
    }
    path = tmp_path / "raw_audio_fixed.pkl"
    path.write_bytes(python2.dumps(corpus))
    started = time.process_time()
    back = read_pickle(path)
    assert time.process_time() - started < 2  # 51 MB; 0.03 s on a machine at rest
    assert np.array_equal(back["subject7"]["sentence39"]["audio"], sound + 39)
    assert back["subject0"]["sentence00"]["sample_rate"] == 22050


class Calls:
    """Pickles as a call of anything."""

    def __init__(self, function, *arguments):
        self.parts = function, arguments

    def __reduce__(self):
        return self.parts


class TestNothingRuns:
    """Each payload would leave a marker file if Python's own unpickler read it."""

    @pytest.mark.parametrize("protocol", PROTOCOLS)
    def test_calls_of_the_system(self, refused, tmp_path, protocol):
        marker = tmp_path / "marker"
        payload = pickle.dumps({"v_template": Calls(os.system, f"touch {marker}")}, protocol)
        refused(payload, f"found the global {os.name}.system", "allowed: chumpy.ch.Ch")
        assert not marker.exists()
        pickle.loads(payload)  # the payload is a live one
        assert marker.exists()

    def test_eval(self, refused, tmp_path):
        marker = tmp_path / "marker"
        code = f"open({str(marker)!r}, 'w').close()"
        for protocol in PROTOCOLS:
            refused(pickle.dumps(Calls(eval, code), protocol), "builtin", ".eval; allowed: ")
        refused(b"c__builtin__\neval\n(S'1'\ntR.", "found the global __builtin__.eval")
        refused(b"(S'touch x'\nios\nsystem\n.", "found the global os.system")
        refused(b"(cos\nsystem\nS'touch x'\no.", "found the global os.system")
        assert not marker.exists()

    def test_a_call_within_a_call(self, refused, tmp_path):
        marker = tmp_path / "marker"
        inner = Calls(os.system, f"touch {marker}")
        refused(pickle.dumps(Calls(np.dtype, inner)), f"found the global {os.name}.system")
        state = {"x": inner}
        refused(pickle.dumps([csc_matrix(np.eye(2)), state]), f"{os.name}.system")
        assert not marker.exists()

    def test_numpy_load_and_other_parts_of_known_modules(self, refused):
        refused(pickle.dumps(Calls(np.load, "x.npy")), "found the global numpy.load")
        refused(b"cnumpy.core.multiarray\nfromfile\n.", "numpy.core.multiarray.fromfile")
        # Dotted names of protocol 4 reach attributes of attributes.
        refused(b"\x80\x04\x8c\x05numpy\x8c\x0edtype.__init__\x93.", "numpy.dtype.__init__")

    def test_known_globals_used_for_something_else(self, refused):
        refused(b"cnumpy\nndarray\n(tR.", "a call of numpy.ndarray")
        refused(b"cnumpy\nndarray\n.", "numpy.ndarray as a value")
        refused(b"cnumpy\ndtype\n)\x81.", "a new numpy.dtype")
        refused(b"c_codecs\nencode\n(S'a'\nS'rot13'\ntR.", "_codecs.encode")
        refused(b"c_codecs\nencode\n(S'a'\ntR.", "other arguments")
        refused(b"S'a'\n(tR.", "a call of a str")
        refused(b"]}b.", "a state for a list")

    @pytest.mark.parametrize(
        ("data", "name"),
        [
            (b"P1\n.", "PERSID"),
            (b"NQ.", "BINPERSID"),
            (b"\x82\x01.", "EXT1"),
            (b"\x80\x05\x97.", "NEXT_BUFFER"),
            (b"\x80\x04(\x91.", "FROZENSET"),
            (b"\x80\x04cnumpy\ndtype\n)}\x92.", "NEWOBJ_EX"),
        ],
    )
    def test_opcodes_that_no_such_file_needs_are_refused_by_name(self, refused, data, name):
        refused(data, f"found the opcode {name}")


class TestArraysThatLie:
    def array(self, shape=(3,), dtype=b"f8", raw=b"\0" * 24, order=b"<"):
        """An array as protocol 0 spells it, each part forged at will."""
        return b"".join(
            [
                b"cnumpy.core.multiarray\n_reconstruct\n(cnumpy\nndarray\n(I0\ntS'b'\ntR(I1\n(",
                *(b"L%dL\n" % size for size in shape),
                b"tcnumpy\ndtype\n(S'" + dtype + b"'\nI0\nI1\ntR(I3\nS'" + order,
                b"'\nNNNI-1\nI-1\nI0\ntbI00\nT" + struct.pack("<i", len(raw)) + raw + b"tb.",
            ]
        )

    def test_the_forged_layout_is_right(self, read):
        assert np.array_equal(read(self.array()), np.zeros(3))

    @pytest.mark.parametrize(
        "shape", [(2**39,), (10**9, 10**9, 10**9), (4,), (-1,), (2**80,), (1,) * 40]
    )
    def test_shapes_that_their_bytes_do_not_fill(self, refused, shape):
        refused(self.array(shape), "an array of shape")

    def test_arrays_of_objects_and_records(self, refused):
        refused(self.array(dtype=b"O8"), "an array of type O8", "allowed: numbers")
        refused(pickle.dumps(np.array([{}], object)), "an array of type O8")
        refused(pickle.dumps(np.zeros(2, [("a", "f4")])), "an array of type V4")
        refused(pickle.dumps(np.array(["a"])), "an array of type U1")
        refused(self.array(order=b"x"), "byte order")
        refused(self.array(dtype=b"b1", raw=b"\0\1\2", order=b"|"), "truth values")

    def test_data_that_are_no_bytes(self, refused):
        refused(self.array().replace(b"\nT\x18\0\0\0" + b"\0" * 24, b"\n]"), "are a list")

    @pytest.mark.parametrize(
        ("part", "values", "word"),
        [
            ("indices", [0, 7], "index outside 0…2"),
            ("indices", [0, -1], "index outside 0…2"),
            ("indptr", [0, 2, 1, 2], "does not rise"),
            ("indptr", [1, 1, 1, 2], "does not rise"),
            ("indptr", [0, 1, 1, 9], "does not rise"),
            ("indptr", [0, 2], "do not fit"),
            ("indptr", [0.0, 1, 1, 2], "no whole numbers"),
            ("data", [1.0], "do not fit"),
            ("_shape", (3, 2**40), "of shape"),
            ("_shape", (2**30, 3), None),
            ("_shape", "large", "of shape that is a str"),
        ],
    )
    def test_sparse_matrices_whose_parts_disagree(self, read, refused, part, values, word):
        matrix = csc_matrix(np.array([[1.0, 0, 0], [0, 0, 0], [0, 0, 2]]))
        is_list = isinstance(values, list)
        setattr(matrix, part, np.array(values) if is_list else values)
        if word:
            refused(pickle.dumps(matrix, 2), "csc matrix", word)
        else:  # a large shape alone takes no memory
            assert read(pickle.dumps(matrix, 2)).shape == (2**30, 3)

    def test_chumpy_selections_of_what_is_not_there(self, refused, python2):
        for chosen in ([0, 9], [-1], [0.5]):
            item = python2.Select(a=np.arange(3.0), idxs=np.array(chosen))
            refused(python2.dumps(item), "selection of what is not there")
        item = python2.Select(a=np.arange(3.0), idxs=np.array([1]), preferred_shape=(9,))
        refused(python2.dumps(item), "selection of shape")
        refused(python2.dumps(python2.Ch(y=1)), "without an array 'x'")
        refused(b"cchumpy.ch\nCh\n)\x81.", "before it was filled")


class TestBrokenFiles:
    def test_text_and_other_files(self, refused):
        for data in (b"", b"hello, this is no pickle", b"PK\x03\x04", b"\x93NUMPY", bytes(100)):
            refused(data)
        refused(b"\x80\x02\xff.", "no pickle, or a broken one (byte 255 at 2", "a whole pickle")

    def test_a_missing_file_and_a_folder(self, tmp_path):
        with pytest.raises(InputError, match=r"no\.pkl: no such file; allowed: a pickle"):
            read_pickle(tmp_path / "no.pkl")
        for other, found in ((tmp_path, "a folder"), ("/dev/null", "no regular file")):
            with pytest.raises(InputError, match=found):
                read_pickle(other)

    def test_too_large_a_file(self, refused):
        refused(pickle.dumps(b"x" * 3000), "3.018 kB", "up to 1 kB", max_bytes=1000)

    def test_every_cut_is_refused(self, refused, python2):
        whole = python2.dumps(python2.flame(vertices=12, components=4))
        for end in [*range(400), *range(400, len(whole), 97)]:
            refused(whole[:end])

    def test_promises_of_length_take_no_memory(self, refused):
        for data in (
            b"T\xff\xff\xff\x7f",
            b"X\xff\xff\xff\xff",
            b"\x8e" + b"\xff" * 8,
            b"\x96" + b"\xff" * 7 + b"\x7f",
            b"\x80\x04\x95" + b"\xff" * 8,
            b"T\xff\xff\xff\xff",
            b"\x8b\xff\xff\xff\x7f",
            b"\x8b\xff\xff\xff\xff",
        ):
            refused(data + b"abc.")
        refused(b"L" + b"9" * 10_000 + b"\n.", "no whole number")
        refused(b"r\xff\xff\xff\x7f.", "nothing on the stack")

    def test_stacks_and_marks_that_do_not_fit(self, refused):
        cut = (
            "., 0., t., a., ]a., N(0, N(\x85., }Ns., }(Nu., g5\n., R., b., 2., 1., ]]s., (., \x93."
        )
        for data in cut.split(", "):
            refused(data.encode("latin-1"))

    def test_a_small_file_does_not_unfold(self, refused):
        # A million entries, copied into a set again and again.
        items = b"".join(b"J" + struct.pack("<i", n) for n in range(100_000))
        copies = b"c__builtin__\nset\n(g1\ntR" * 400
        refused(b"(" + items + b"lp1\n" + copies + b".", "unfolds")

    def test_deep_and_knotted_nesting(self, read, refused):
        deep = read(b"]" * 200_000 + b"a" * 199_999 + b".")
        assert isinstance(deep, list)
        knots = b"N" + b"p0\ng0\n\x86" * 5000 + b"."
        refused(knots, "unfolds")  # read in no time, but nobody could ever walk over it
        refused(b"}" + knots[:-1] + b"Ns.", "a tuple as a key")
        refused(b"cnumpy\ndtype\n" + knots[:-1] + b"\x85R.", "an array of type tuple")

    @pytest.mark.slow
    def test_random_damage_is_always_one_line(self, read, python2):
        whole = python2.dumps(python2.flame(vertices=12, components=2))
        rng = np.random.default_rng(0)
        for _ in range(1500):
            data = bytearray(whole)
            for _ in range(rng.integers(1, 4)):
                place = rng.integers(0, min(600, len(data)) if rng.random() < 0.7 else len(data))
                data[place] = rng.integers(0, 256)
            try:
                read(bytes(data))
            except InputError as error:
                assert "\n" not in str(error)
