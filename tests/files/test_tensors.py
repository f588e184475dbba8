"""The header of a .safetensors file against the bytes that are there."""

import json

import pytest

from elocute.errors import ModelError
from elocute.files.reading import FileKind
from elocute.files.safetensors_header import read_tensor_header

WHOLE = {"w": {"dtype": "F32", "shape": [2, 3], "data_offsets": [0, 24]}}


def packed(record: object, content: bytes = bytes(24)) -> bytes:
    text = json.dumps(record).encode()
    return len(text).to_bytes(8, "little") + text + content


def read(path, data: bytes):
    path.write_bytes(data)
    return read_tensor_header(path, FileKind("weights", 10_000, ModelError))


def test_shapes_and_metadata_are_told(tmp_path):
    header = read(tmp_path / "a", packed({"__metadata__": {"by": "us"}, **WHOLE}))
    assert (header.shapes, header.metadata) == ({"w": (2, 3)}, {"by": "us"})


@pytest.mark.parametrize(
    "data",
    [
        b"",
        b"1234567",
        (2**63).to_bytes(8, "little") + b"{}",
        packed([]),
        packed(WHOLE, b""),
        packed(WHOLE, bytes(25)),
        packed({"w": {**WHOLE["w"], "shape": [2**40, 2**40]}}),
        packed({"w": {**WHOLE["w"], "shape": [-2, -3]}}),
        packed({"w": {**WHOLE["w"], "dtype": 1}}),
        packed({"w": {**WHOLE["w"], "data_offsets": [0, 10**30]}}),
        packed({"w": None}),
        packed({**WHOLE, "v": WHOLE["w"]}),
        packed({"__metadata__": 1}),
        packed({"w": []}),
    ],
)
def test_what_does_not_fit_is_refused(tmp_path, data):
    with pytest.raises(ModelError) as caught:
        read(tmp_path / "a", data)
    assert len(str(caught.value).splitlines()) == 1
