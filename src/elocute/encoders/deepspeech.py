"""Mozilla DeepSpeech 0.1.0, VOCA's speech features: sound in, 29 character logits at 50 Hz out.

The weights are read out of the user's `output_graph.pb` as data; the network around them is
written here as an ONNX graph (three dense layers, a bidirectional LSTM, two dense layers).
Sources: VOCA 2019, sections 3 and 5, and its released audio_handler.py; DeepSpeech.py of 0.1.0.
"""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array
from elocute.audio.features import Features
from elocute.audio.spectral import mfcc
from elocute.audio.waveform import SPEECH_RATE, Waveform
from elocute.encoders.frozen_graph import FrozenGraph, read_frozen_graph
from elocute.encoders.onnx_graph import Network, Step, step, write_graph
from elocute.encoders.protocol import FEATURE_RATE, as_features, encoder_samples
from elocute.errors import InputError

Weights = dict[str, NDArray[Any]]

CHARACTERS = 29  # a to z, space, apostrophe, blank
COEFFICIENTS = 26
CONTEXT = 9  # frames before and after
INPUTS = (2 * CONTEXT + 1) * COEFFICIENTS
RELU_LIMIT = 20.0
WIDTH_MAX = 8192  # of a layer; the release has 2048
FORGET_BIAS = 1.0  # TensorFlow's BasicLSTMCell adds it; it is not in the stored bias
FULL_SCALE = 32768.0
LONGEST_S = 300.0
"""The LSTM reads a whole utterance from both ends; five minutes take about 4 GB."""

RELEASE = "Mozilla DeepSpeech 0.1.0's output_graph.pb"
ENDS = {"input_node": "Placeholder", "input_lengths": "Placeholder", "logits": ""}
CELLS = ("bidirectional_rnn/fw/basic_lstm_cell", "bidirectional_rnn/bw/basic_lstm_cell")


class DeepSpeech:
    """The encoder `deepspeech:PATH.pb`. Raises InputError where the file is missing."""

    name = "deepspeech"
    feature_count = CHARACTERS
    rate = FEATURE_RATE

    def __init__(self, path: str | Path) -> None:
        self.path = Path(path)
        if not self.path.is_file():
            raise InputError.about(self.path, found="missing", allowed=RELEASE)

    @cached_property
    def _network(self) -> Network:
        weights = read_weights(self.path)
        # One thread for each direction of the LSTM, where nearly all of the time goes.
        return Network(write_network(weights), weights, threads=2)

    def __call__(self, waveform: Waveform) -> Features:
        """Raises InputError for sound of over five minutes or a file that is not DeepSpeech."""
        if waveform.duration_s > LONGEST_S:
            raise InputError.about(
                "deepspeech",
                found=f"{waveform.duration_s:.0f} s of sound",
                allowed=f"{LONGEST_S:.0f} s",
                remedy="cut it into utterances",
            )
        logits = self._network.run("logits", input_node=input_vectors(encoder_samples(waveform)))
        return as_features(waveform, logits, self.name)


def input_vectors(samples: Float32Array) -> Float32Array:
    """(sample,) at 16 kHz, full scale ±1, to the (frame, 494) that the network reads at 50 Hz.

    MFCCs of every second 10 ms frame with nine frames before and after, zeros beyond the ends,
    standardised over the whole utterance. The network was trained on 16-bit samples and its first
    coefficient is an absolute energy, so the sound is scaled to them, and rounded: a 16-bit file
    at 16 kHz goes in as it is. (VOCA's own code casts without scaling, which needs such files.)
    """
    sixteen_bit = np.clip(np.rint(samples * FULL_SCALE), -FULL_SCALE, FULL_SCALE - 1)
    frames = mfcc(sixteen_bit, SPEECH_RATE, COEFFICIENTS)[::2]
    padded = np.pad(frames, ((CONTEXT, CONTEXT), (0, 0)))
    views = np.lib.stride_tricks.sliding_window_view(padded, 2 * CONTEXT + 1, axis=0)
    vectors = views.swapaxes(1, 2).reshape(len(frames), INPUTS)
    return ((vectors - vectors.mean()) / vectors.std()).astype(np.float32)


def read_weights(path: str | Path) -> Weights:
    """The network's arrays under ONNX's names and orders.

    Raises InputError where a node is missing, or a shape does not follow from those before it.
    """
    graph = read_frozen_graph(path)
    _check_ends(graph)
    width = INPUTS
    weights: Weights = {}
    for layer in "123":
        width = _read_dense(graph, layer, width, weights)
    kernels, biases = zip(*(_read_cell(graph, cell, width) for cell in CELLS), strict=True)
    units = kernels[0].shape[1] // 4
    if kernels[0].shape != kernels[1].shape:
        raise _misshapen(graph, CELLS[1], kernels[1].shape, str(kernels[0].shape))
    weights |= _lstm(np.stack(kernels), np.stack(biases), width)
    width = _read_dense(graph, "5", 2 * units, weights)
    width = _read_dense(graph, "6", width, weights)
    if width != CHARACTERS:
        raise _misshapen(graph, "h6", weights["h6"].shape, f"(*, {CHARACTERS})")
    return weights | {
        "low": np.array(0, np.float32),
        "high": np.array(RELU_LIMIT, np.float32),
        "one": np.array([1], np.int64),
        "joined": np.array([-1, 2 * units], np.int64),
    }


def _check_ends(graph: FrozenGraph) -> None:
    """Refuse other releases of DeepSpeech early; they share some names."""
    missing = [name for name in (*ENDS, "h1", "h6") if name not in graph.nodes]
    if missing:
        raise InputError.about(graph.path, found=f"no node {', '.join(missing)}", allowed=RELEASE)
    for name, operation in ENDS.items():
        if operation and graph.nodes[name][0] != operation:
            raise InputError.about(
                graph.path, found=f"node {name!r} is {graph.nodes[name][0]!r}", allowed=operation
            )


def _read_dense(graph: FrozenGraph, layer: str, width: int, weights: Weights) -> int:
    """Read h (in, out) and b (out,) of a layer; returns its width."""
    matrix = _floats(graph, f"h{layer}")
    if matrix.ndim != 2 or len(matrix) != width or matrix.shape[1] > WIDTH_MAX:
        raise _misshapen(graph, f"h{layer}", matrix.shape, f"({width}, up to {WIDTH_MAX})")
    bias = _floats(graph, f"b{layer}")
    if bias.shape != matrix.shape[1:]:
        raise _misshapen(graph, f"b{layer}", bias.shape, str(matrix.shape[1:]))
    weights |= {f"h{layer}": matrix, f"b{layer}": bias}
    return matrix.shape[1]


def _read_cell(graph: FrozenGraph, cell: str, width: int) -> tuple[Float32Array, Float32Array]:
    """Kernel (input + unit, 4 unit) and bias (4 unit,) of one direction, gates i j f o."""
    kernel = _floats(graph, _either(graph, f"{cell}/kernel", f"{cell}/weights"))
    units = kernel.shape[-1] // 4 if kernel.ndim == 2 else 0
    if not 0 < units <= WIDTH_MAX or kernel.shape != (width + units, 4 * units):
        raise _misshapen(graph, f"{cell}/kernel", kernel.shape, f"({width} + n, 4 n)")
    bias = _floats(graph, _either(graph, f"{cell}/bias", f"{cell}/biases"))
    if bias.shape != (4 * units,):
        raise _misshapen(graph, f"{cell}/bias", bias.shape, f"({4 * units},)")
    return kernel, bias


def _either(graph: FrozenGraph, name: str, older: str) -> str:
    """TensorFlow renamed its LSTM's variables with release 1.2."""
    return older if older in graph.nodes and name not in graph.nodes else name


def _floats(graph: FrozenGraph, name: str) -> Float32Array:
    array = graph.constant(name)
    if array.dtype != np.float32 or not np.isfinite(array).all():
        fault = "NaN or infinity" if array.dtype == np.float32 else str(array.dtype)
        raise InputError.about(graph.path, found=f"{fault} in node {name!r}", allowed=RELEASE)
    # A tensor in a file stands at any byte; arithmetic wants it aligned.
    return np.require(array, np.float32, ["C", "A"])


def _misshapen(graph: FrozenGraph, name: str, shape: tuple[int, ...], allowed: str) -> InputError:
    return InputError.about(
        graph.path, found=f"node {name!r} of shape {shape}", allowed=f"{allowed} in {RELEASE}"
    )


def _lstm(kernels: Float32Array, biases: Float32Array, width: int) -> Weights:
    """TensorFlow's BasicLSTMCell as ONNX's LSTM: gates i j f o become i o f j, rows columns.

    kernels (direction, input + unit, 4 unit), biases (direction, 4 unit).
    """
    i, j, f, o = np.split(kernels, 4, axis=2)
    matrix = np.concatenate([i, o, f, j], axis=2).swapaxes(1, 2)
    i, j, f, o = np.split(biases, 4, axis=1)
    bias = np.concatenate([i, o, f + np.float32(FORGET_BIAS), j], axis=1)
    return {
        "w": np.ascontiguousarray(matrix[:, :, :width]),
        "r": np.ascontiguousarray(matrix[:, :, width:]),
        "b": np.concatenate([bias, np.zeros_like(bias)], axis=1),
    }


def write_network(weights: Weights) -> bytes:
    """The ONNX graph: input_node (frame, 494) to logits (frame, 29)."""
    units = weights["r"].shape[2]
    steps = [
        *_dense("1", "input_node"),
        *_dense("2", "y1"),
        *_dense("3", "y2"),
        step("Unsqueeze", "y3 one", "sequence"),
        step("LSTM", "sequence w r b", "both", direction="bidirectional", hidden_size=units),
        step("Reshape", "both joined", "y4"),
        *_dense("5", "y4"),
        step("Gemm", "y5 h6 b6", "logits"),
    ]
    return write_graph(steps, weights, {"input_node": INPUTS}, {"logits": CHARACTERS})


def _dense(layer: str, source: str) -> list[Step]:
    """min(max(0, x h + b), 20)."""
    return [
        step("Gemm", f"{source} h{layer} b{layer}", f"x{layer}"),
        step("Clip", f"x{layer} low high", f"y{layer}"),
    ]
