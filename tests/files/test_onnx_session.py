"""Networks are complete in their own file."""

import resource

import numpy as np
import pytest

from elocute.encoders.onnx_graph import step, write_graph
from elocute.errors import ModelError
from elocute.files.onnx_session import open_session
from elocute.files.protobuf import write_message
from elocute.files.reading import FileKind

NETWORK = FileKind("a network (.onnx)", 1_000_000, ModelError)


def test_a_network_runs(tmp_path):
    weights = {"w": np.eye(3, dtype=np.float32)}
    graph = write_graph([step("MatMul", "x w", "y")], weights, {"x": 3}, {"y": 3})
    (tmp_path / "a.onnx").write_bytes(graph)
    session = open_session(tmp_path / "a.onnx", NETWORK)
    x = np.ones((2, 3), np.float32)
    np.testing.assert_array_equal(session.run(["y"], {"x": x})[0], x)


def test_a_network_that_names_another_file_is_refused(tmp_path, monkeypatch):
    """Weights above a kilobyte are declared as kept in a file called `beside`."""
    monkeypatch.chdir(tmp_path)
    (tmp_path / "beside").write_bytes(np.eye(30, dtype=np.float32).tobytes())
    weights = {"w": np.eye(30, dtype=np.float32)}
    graph = write_graph([step("MatMul", "x w", "y")], weights, {"x": 30}, {"y": 30})
    (tmp_path / "a.onnx").write_bytes(graph)
    with pytest.raises(ModelError, match="weights kept in other files"):
        open_session(tmp_path / "a.onnx", NETWORK)


@pytest.mark.parametrize("content", [b"", b"\0", b"no network", b"\x3a\x05\xff"])
def test_what_is_no_network_is_one_line(tmp_path, content):
    (tmp_path / "a.onnx").write_bytes(content)
    with pytest.raises(ModelError, match="no ONNX network"):
        open_session(tmp_path / "a.onnx", NETWORK)


def a_network(path, *steps, model=(), **weights):
    """Of x (frame, 3) to y, with fields of the model's own besides."""
    arrays = {"w": np.eye(3, dtype=np.float32), **weights}
    path.write_bytes(write_graph(steps, arrays, {"x": 3}, {"y": 3}) + write_message(*model))
    return path


@pytest.mark.parametrize("operator", ["Loop", "Scan", "SequenceMap"])
def test_what_may_never_end_is_refused(tmp_path, operator):
    path = a_network(tmp_path / "a.onnx", step("MatMul", "x w", "y"), step(operator, "x", "z"))
    with pytest.raises(ModelError, match=f"the operator {operator}, which may never end"):
        open_session(path, NETWORK)


def test_functions_of_a_file_are_refused(tmp_path):
    """Forty that call the next one twice would be unfolded to a trillion operators."""
    function = write_message((1, "f"), (4, "x"), (5, "y"), (10, "own"))
    path = a_network(tmp_path / "a.onnx", step("MatMul", "x w", "y"), model=[(25, function)])
    with pytest.raises(ModelError, match="a function inside a network"):
        open_session(path, NETWORK)


def test_operators_that_are_not_of_onnx_are_refused(tmp_path):
    node = write_message((1, "x"), (2, "y"), (4, "Gelu"), (7, "com.microsoft"))
    path = a_network(tmp_path / "a.onnx", model=[(7, write_message((1, node)))])
    with pytest.raises(ModelError, match="none of ONNX's own"):
        open_session(path, NETWORK)


def test_too_many_operators_are_refused(tmp_path):
    steps = [step("Identity", "x", f"y{number}") for number in range(10_001)]
    with pytest.raises(ModelError, match="more than 10000 operators"):
        open_session(a_network(tmp_path / "a.onnx", *steps), NETWORK)


@pytest.mark.parametrize("size", [2**28, 2**40])
def test_memory_of_a_network_is_limited(tmp_path, size):
    """A few bytes ask for a gigabyte, or for a thousand."""
    shape = np.array([size], np.int64)
    steps = [
        step("ConstantOfShape", "shape", "large"),
        step("ReduceSum", "large", "sum", keepdims=0),
        step("MatMul", "x w", "z"),
        step("Add", "z sum", "y"),
    ]
    path = a_network(tmp_path / "a.onnx", *steps, shape=shape)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(Exception, match=r"ConstantOfShape|no ONNX network"):
        open_session(path, NETWORK).run(["y"], {"x": np.ones((2, 3), np.float32)})
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000
