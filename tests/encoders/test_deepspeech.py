"""DeepSpeech 0.1.0 against python_speech_features, torch's LSTM and plain NumPy; forged graphs.

The graphs are written here byte by byte, with the node names of the released one.
"""

import struct

import numpy as np
import pytest
import python_speech_features as psf
import torch

from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.encoders import deepspeech
from elocute.encoders.deepspeech import DeepSpeech, input_vectors
from elocute.encoders.registry import resolve_encoder
from elocute.errors import InputError

INPUTS = 494
CELLS = [f"bidirectional_rnn/{way}/basic_lstm_cell" for way in ("fw", "bw")]
HIDDEN = 24


def varint(value: int) -> bytes:
    out = b""
    while value > 127:
        out, value = out + bytes([value % 128 + 128]), value // 128
    return out + bytes([value])


def field(number: int, content: bytes | int) -> bytes:
    if isinstance(content, int):
        return varint(number * 8) + varint(content)
    return varint(number * 8 + 2) + varint(len(content)) + content


def shape_of(*sizes: int) -> bytes:
    return b"".join(field(2, field(1, size)) for size in sizes)


def tensor(array: np.ndarray) -> bytes:
    kind = {"f": 1, "i": 3}[array.dtype.kind]
    return field(1, kind) + field(2, shape_of(*array.shape)) + field(4, array.tobytes())


def node(name: str, operation: str, proto: bytes | None = None) -> bytes:
    content = field(1, name.encode()) + field(2, operation.encode())
    if proto is not None:
        content += field(5, field(1, b"dtype") + field(2, field(6, 1)))
        content += field(5, field(1, b"value") + field(2, field(8, proto)))
    return field(1, content)


def graph(weights: dict[str, np.ndarray], changes: dict[str, bytes] | None = None) -> bytes:
    """A GraphDef of Const weights; `changes` replaces nodes or adds bytes."""
    nodes = {name: node(name, "Const", tensor(array)) for name, array in weights.items()}
    nodes |= {name: node(name, "Placeholder") for name in ("input_node", "input_lengths")}
    nodes["logits"] = node("logits", "Identity")
    nodes |= changes or {}
    return b"".join(nodes.values()) + field(4, field(1, 24))  # and its versions


def make_weights(hidden: int = HIDDEN, older: bool = False) -> dict[str, np.ndarray]:
    rng = np.random.default_rng(7)

    def normal(*shape: int) -> np.ndarray:
        return (rng.standard_normal(shape) * 2 / np.sqrt(shape[0])).astype(np.float32)

    sizes = {
        "1": (INPUTS, hidden),
        "2": (hidden, hidden),
        "3": (hidden, 2 * hidden),
        "5": (2 * hidden, hidden),
        "6": (hidden, 29),
    }
    weights = {f"h{layer}": normal(*size) for layer, size in sizes.items()}
    weights |= {f"b{layer}": normal(size[1]) for layer, size in sizes.items()}
    for cell in CELLS:
        weights[f"{cell}/{'weights' if older else 'kernel'}"] = normal(3 * hidden, 4 * hidden)
        weights[f"{cell}/{'biases' if older else 'bias'}"] = normal(4 * hidden)
    return weights


def lstm_in_numpy(x: np.ndarray, kernel: np.ndarray, bias: np.ndarray) -> np.ndarray:
    """TensorFlow's BasicLSTMCell as its documentation says: i, j, f, o; forget bias 1."""
    units = len(bias) // 4
    h, c, out = np.zeros(units), np.zeros(units), []
    for row in x:
        i, j, f, o = np.split(np.concatenate([row, h]) @ kernel + bias, 4)
        c = c / (1 + np.exp(-(f + 1))) + np.tanh(j) / (1 + np.exp(-i))
        h = np.tanh(c) / (1 + np.exp(-o))
        out.append(h)
    return np.array(out)


def network_in_numpy(x: np.ndarray, w: dict[str, np.ndarray]) -> np.ndarray:
    w = {name: array.astype(np.float64) for name, array in w.items()}

    def dense(y, layer):
        return np.clip(y @ w[f"h{layer}"] + w[f"b{layer}"], 0, 20)

    y = dense(dense(dense(x, "1"), "2"), "3")
    forward, backward = [(w[f"{cell}/kernel"], w[f"{cell}/bias"]) for cell in CELLS]
    both = [lstm_in_numpy(y, *forward), lstm_in_numpy(y[::-1], *backward)[::-1]]
    return dense(np.concatenate(both, axis=1), "5") @ w["h6"] + w["b6"]


def vectors_by_psf(samples: np.ndarray) -> np.ndarray:
    """The front end as VOCA's released code does it, on 16-bit samples."""
    frames = psf.mfcc(np.rint(samples * 32768).astype(np.int16), 16000, numcep=26)[::2]
    rows = []
    for t in range(len(frames)):
        window = [frames[k] if 0 <= k < len(frames) else np.zeros(26) for k in range(t - 9, t + 10)]
        rows.append(np.concatenate(window))
    return (np.array(rows) - np.mean(rows)) / np.std(rows)


@pytest.fixture(scope="module")
def speech(speech_wav) -> Waveform:
    return Waveform(read_audio(speech_wav, sample_rate=16000).samples[:40000], 16000)


@pytest.fixture(scope="module")
def weights() -> dict[str, np.ndarray]:
    return make_weights()


@pytest.fixture
def store(tmp_path):
    def write(content: bytes):
        path = tmp_path / "output_graph.pb"
        path.write_bytes(content)
        return path

    return write


def test_the_front_end_equals_python_speech_features(speech):
    ours = input_vectors(speech.samples)
    assert ours.shape == (125, INPUTS)
    np.testing.assert_allclose(ours, vectors_by_psf(speech.samples), atol=1e-4)


def test_logits_equal_numpy_computing_the_same_network(speech, weights, store):
    encoder = resolve_encoder(f"deepspeech:{store(graph(weights))}")
    features = encoder(speech)
    theirs = network_in_numpy(vectors_by_psf(speech.samples), weights)
    assert (encoder.name, encoder.feature_count, encoder.rate) == ("deepspeech", 29, 50)
    assert (features.encoder, features.values.shape) == ("deepspeech", (125, 29))
    assert theirs.std() > 0.1
    np.testing.assert_allclose(features.values, theirs, atol=1e-4)


def test_units_are_clipped_at_twenty(weights, store, speech):
    loud = weights | {"h1": weights["h1"] * 12}
    vectors = vectors_by_psf(speech.samples)
    assert (vectors @ loud["h1"] + loud["b1"] > 20).any()
    ours = DeepSpeech(store(graph(loud)))(speech).values
    np.testing.assert_allclose(ours, network_in_numpy(vectors, loud), atol=1e-3)


def test_the_reference_recurrence_equals_torch(weights):
    """So that the reference is not wrong in the same way as what it checks."""
    x = np.random.default_rng(3).standard_normal((30, 2 * HIDDEN)).astype(np.float32)
    kernel, bias = weights[f"{CELLS[0]}/kernel"], weights[f"{CELLS[0]}/bias"]
    i, j, f, o = np.split(kernel.T, 4)
    order = np.concatenate([i, f, j, o])  # torch's order of gates
    i, j, f, o = np.split(bias, 4)
    cell = torch.nn.LSTM(2 * HIDDEN, HIDDEN)
    with torch.no_grad():
        parameters = dict(cell.named_parameters())
        parameters["weight_ih_l0"].copy_(torch.from_numpy(order[:, : 2 * HIDDEN]))
        parameters["weight_hh_l0"].copy_(torch.from_numpy(order[:, 2 * HIDDEN :]))
        parameters["bias_ih_l0"].copy_(torch.from_numpy(np.concatenate([i, f + 1, j, o])))
        parameters["bias_hh_l0"].zero_()
        theirs = cell(torch.from_numpy(x))[0].numpy()
    np.testing.assert_allclose(lstm_in_numpy(x, kernel, bias), theirs, atol=1e-5)


def test_weights_are_found_under_the_names_of_older_tensorflow(speech, weights, store):
    new = DeepSpeech(store(graph(weights)))(speech).values
    old = DeepSpeech(store(graph(make_weights(older=True))))(speech).values
    np.testing.assert_array_equal(new, old)


def test_one_value_may_stand_for_a_whole_bias(speech, weights, store):
    spread = field(1, 1) + field(2, shape_of(HIDDEN)) + field(5, struct.pack("<f", 0.5))
    path = store(graph(weights, {"b2": node("b2", "Const", spread)}))
    ours = DeepSpeech(path)(speech).values
    half = weights | {"b2": np.full(HIDDEN, 0.5, np.float32)}
    np.testing.assert_array_equal(ours, DeepSpeech(store(graph(half)))(speech).values)


@pytest.mark.parametrize("count", [2, 300, 16160, 16240])
def test_features_last_as_long_as_the_sound(count, weights, store):
    sound = Waveform(np.zeros(count, np.float32), 16000)
    values = DeepSpeech(store(graph(weights)))(sound).values
    assert values.shape == (max(1, round(count / 320)), 29)


def test_sound_too_long_for_the_network_is_refused_before_memory_is_taken(store, monkeypatch):
    monkeypatch.setattr(deepspeech, "LONGEST_S", 1.0)
    with pytest.raises(InputError, match="cut it into utterances"):
        DeepSpeech(store(b"unread"))(Waveform(np.zeros(16400, np.float32), 16000))


def refusal(path) -> str:
    """The one line with which a graph is refused."""
    with pytest.raises(InputError) as caught:
        DeepSpeech(path)(Waveform(np.zeros(1600, np.float32), 16000))
    message = str(caught.value)
    assert "output_graph.pb" in message and "\n" not in message
    return message


@pytest.mark.parametrize(
    "name",
    [
        "input_node",
        "input_lengths",
        "logits",
        "h1",
        "b3",
        "h6",
        *(f"{cell}/kernel" for cell in CELLS),
    ],
)
def test_a_missing_node_is_named(name, weights, store):
    assert name in refusal(store(graph(weights, {name: b""})))


@pytest.mark.parametrize(
    "name",
    [
        "h1",
        "b1",
        "h3",
        "h5",
        "b6",
        "h6",
        *(f"{cell}/{part}" for cell in CELLS for part in ("kernel", "bias")),
    ],
)
def test_a_wrong_shape_is_named(name, weights, store):
    assert name in refusal(store(graph(weights | {name: weights[name][:-4]})))
    assert name in refusal(store(graph(weights | {name: weights[name][None]})))


def test_another_alphabet_is_refused(weights, store):
    other = weights | {"h6": np.ascontiguousarray(weights["h6"][:, :28]), "b6": weights["b6"][:28]}
    assert "(24, 28)" in refusal(store(graph(other)))


def const(name: str, proto: bytes) -> dict[str, bytes]:
    return {name: node(name, "Const", proto)}


@pytest.mark.parametrize(
    ("changes", "says"),
    [
        (
            const("h2", field(1, 1) + field(2, shape_of(1 << 40, 1 << 40)) + field(5, b"\0\0\0\0")),
            "1 values for a tensor of shape",
        ),
        (
            const("h2", field(1, 1) + field(2, shape_of(1 << 30)) + field(4, b"\0\0\0\0")),
            "4 bytes for a tensor",
        ),
        (
            const("h2", field(1, 1) + field(2, field(2, b"\x08" + b"\xff" * 9 + b"\x01"))),
            "unknown axis",
        ),
        (const("h2", field(1, 1) + field(2, shape_of(0))), "empty or unknown axis"),
        (const("h2", field(1, 1) + field(2, field(3, 1))), "unknown shape"),
        (const("h2", field(1, 2)), "type 2"),
        (const("h2", b"\xff"), "ends early"),
        (const("h2", field(1, 3) + field(2, shape_of(2)) + field(7, b"\x05\x06")), "int32"),
        (const("b2", tensor(np.full(HIDDEN, np.nan, np.float32))), "NaN"),
        ({"h2": node("h2", "Identity")}, "'Identity'"),
        ({"h2": node("h2", "Const")}, "no tensor"),
        ({"input_node": node("input_node", "PyFunc")}, "PyFunc"),
        ({"more": node("h2", "Const")}, "twice"),
        ({"more": field(1, b"")}, "without a name"),
        ({"more": b"\x0b"}, "wire type 3"),
        ({"more": b"\x0a" + b"\xff" * 9 + b"\x01"}, "ends early"),
        ({"more": b"\x0a" + b"\xff" * 11}, "ten bytes"),
        ({"more": field(1, field(5, b"") * 3000)}, "more than 2000 fields"),
        ({"more": b"\x10\x01" * 30000}, "more than 20000 fields"),
    ],
)
def test_a_forged_graph_is_refused(changes, says, weights, store):
    assert says in refusal(store(graph(weights, changes)))


def test_a_truncated_graph_is_refused_wherever_it_is_cut(weights, store):
    whole = graph(weights)
    for at in np.linspace(1, len(whole) - 5, 40).astype(int):
        refusal(store(whole[:at]))


def test_bytes_turned_at_random_never_raise_another_error(store):
    rng = np.random.default_rng(11)
    whole = graph(make_weights(4))
    sound = Waveform(np.zeros(1600, np.float32), 16000)
    for _ in range(60):
        turned = bytearray(whole)
        # Half of the turned bytes among the names and sizes of the first nodes.
        for at in (*rng.integers(0, len(whole), 8), *rng.integers(0, 200, 8)):
            turned[at] = rng.integers(256)
        try:
            DeepSpeech(store(bytes(turned)))(sound)
        except InputError as error:
            assert "\n" not in str(error)


@pytest.mark.parametrize(
    "content", [b"", b"not a graph", b"\x80\x04\x95pickle", field(4, field(1, 24))]
)
def test_what_is_no_graph_is_refused(content, store):
    refusal(store(content))
