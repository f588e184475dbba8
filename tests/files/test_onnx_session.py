"""Networks are complete in their own file."""

import numpy as np
import pytest

from elocute.encoders.onnx_graph import step, write_graph
from elocute.errors import ModelError
from elocute.files.onnx_session import open_session

LIMITS = {"max_bytes": 1_000_000, "allowed": "a network (.onnx)"}


def test_a_network_runs(tmp_path):
    weights = {"w": np.eye(3, dtype=np.float32)}
    graph = write_graph([step("MatMul", "x w", "y")], weights, {"x": 3}, {"y": 3})
    (tmp_path / "a.onnx").write_bytes(graph)
    session = open_session(tmp_path / "a.onnx", **LIMITS)
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
        open_session(tmp_path / "a.onnx", **LIMITS)


@pytest.mark.parametrize("content", [b"", b"\0", b"no network", b"\x3a\x05\xff"])
def test_what_is_no_network_is_one_line(tmp_path, content):
    (tmp_path / "a.onnx").write_bytes(content)
    with pytest.raises(ModelError, match="no ONNX network"):
        open_session(tmp_path / "a.onnx", **LIMITS)
