"""`web/speech` in Chromium: stage by stage what Python gives, and curves as `talkers` makes them.

The trunk rounds what it hears to whole numbers, layer after layer, so that sums in another order
become a slightly other mouth. Its answers are therefore played back where all else is to be exact,
and compared loosely where the browser computes them itself.
"""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import pytest

import elocute
from elocute.array_types import Float32Array
from elocute.audio.read import read_audio
from elocute.audio.resampling_stream import RESAMPLING_S, ResamplingStream
from elocute.audio.waveform import SPEECH_RATE
from elocute.audio.whisper_mel import WhisperMel
from elocute.encoders.trunk import builtin_trunk
from elocute.models.curve_stream import CurveStream
from elocute.models.talkers import TalkersModel
from tests.support.browser_speech import SpeechPage, open_speech_page

pytestmark = pytest.mark.browser


@pytest.fixture(scope="module")
def page(
    need: Callable[[object, str], None], tmp_path_factory: pytest.TempPathFactory
) -> Iterator[SpeechPage]:
    with open_speech_page(need, tmp_path_factory.mktemp("speech")) as opened:
        yield opened


@pytest.fixture(scope="module")
def speech(speech_wav: Any) -> Float32Array:
    """Two seconds, at 16 kHz."""
    samples = read_audio(speech_wav, sample_rate=SPEECH_RATE).samples
    return samples[SPEECH_RATE // 2 : 5 * SPEECH_RATE // 2]


def clips(speech: Float32Array) -> dict[str, Float32Array]:
    draw = np.random.default_rng(1)
    middle, silence = speech[SPEECH_RATE // 2 :], np.zeros(SPEECH_RATE, np.float32)
    return {
        "speech": speech,
        "silence": silence,
        "noise": (0.1 * draw.standard_normal(SPEECH_RATE)).astype(np.float32),
        "quiet": np.concatenate([np.float32(0.001) * middle, silence[:8000], middle]),
        "short": speech[8000:8500],
    }


CLIPS = ("speech", "silence", "noise", "quiet", "short")


class Recorder:
    """The session of the trunk; what it was given and what it answered is kept."""

    def __init__(self) -> None:
        self._session = builtin_trunk().session
        self.runs: list[tuple[dict[str, np.ndarray], list[np.ndarray]]] = []

    def run(self, names: list[str], inputs: dict[str, np.ndarray]) -> list[np.ndarray]:
        answers = self._session.run(names, inputs)
        self.runs.append(({name: inputs[name].copy() for name in COMPARED}, answers))
        return answers

    def __getattr__(self, name: str) -> Any:
        return getattr(self._session, name)

    def give(self, page: SpeechPage) -> list[list[list[Any]]]:
        """All that was kept, in one file; the page is told names and sizes."""
        outputs = [output.name for output in self._session.get_outputs()]
        arrays: list[np.ndarray] = []
        told = []
        for inputs, answers in self.runs:
            given = [(name, inputs[name]) for name in COMPARED]
            given += list(zip(outputs, answers, strict=True))
            arrays += [array.astype(np.float32).ravel() for _, array in given]
            told.append([[name, array.size] for name, array in given])
        page.give("runs", np.concatenate(arrays))
        return told


COMPARED = ("bands", "positions", "windows", "seen_0", "seen_3", "keys_2", "rows_0", "last_before")
REPLAYED = """
const [sizes, settings, blocks, compared] = given, { floats, createSpeech, ort, tables } = elocute;
const all = await floats("runs");
let run = 0, at = 0, apart = 0;
const session = {
  async run(inputs) {
    const outputs = {};
    for (const [name, size] of sizes[run++]) {
      const data = all.subarray(at, at += size), asked = inputs[name]?.data;
      if (!compared.includes(name)) outputs[name] = { data };
      else if (asked.length !== size) throw new Error(`${name} of ${asked.length}`);
      else data.forEach((value, place) => {
        apart = Math.max(apart, Math.abs(value - Number(asked[place])));
      });
    }
    return outputs;
  },
};
const speech = await createSpeech({ ort, trunk: session, tables, ...settings });
const samples = await floats("samples"), values = [];
const take = (frames) => values.push(...(frames?.values ?? []));
let from = 0;
for (const size of blocks) take(await speech.push(samples.subarray(from, from += size)));
take(await speech.flush());
const { names, lookahead } = speech;
return { names, lookahead, values, apart, left: all.length - at };
"""


def streamed(stream: CurveStream, samples: Float32Array, blocks: list[int]) -> Float32Array:
    """All frames of blocks of so many samples."""
    ends = np.cumsum(blocks)[:-1]
    parts = [*(stream.push(block) for block in np.split(samples, ends)), stream.flush()]
    return np.concatenate([part.values for part in parts if part is not None])


def check_replayed(
    page: SpeechPage, samples: Float32Array, blocks: list[int], **settings: Any
) -> None:
    """Whether the browser asks the network what Python asks, and makes the same of its answers."""
    recorder = Recorder()
    given = {"rate": SPEECH_RATE, **settings}
    stream = CurveStream(TalkersModel(session=recorder), given.pop("rate"), **given)
    wanted = streamed(stream, samples, blocks)
    page.give("samples", samples)
    told = page.run(REPLAYED, recorder.give(page), settings, blocks, COMPARED)
    assert told["apart"] < 1e-4 and told["left"] == 0
    assert -1e-6 < stream.lookahead_s - told["lookahead"] < RESAMPLING_S + 1e-6
    got = np.array(told["values"], np.float32).reshape(-1, len(told["names"]))
    assert got.shape == wanted.shape
    assert np.abs(got - wanted).max() < 1e-5


@pytest.mark.parametrize("clip", CLIPS)
def test_curves_of_a_whole_sound_are_those_of_python(
    page: SpeechPage, speech: Float32Array, clip: str
) -> None:
    samples = clips(speech)[clip]
    check_replayed(page, samples, [len(samples)])


@pytest.mark.parametrize("style", ["drawl", "wry", "smiling", "crisp"])
def test_styles_are_those_of_python(page: SpeechPage, speech: Float32Array, style: str) -> None:
    check_replayed(page, speech, [len(speech)], style=style, strength=1.3, fps=25)


@pytest.mark.parametrize(("clip", "lookahead"), [("quiet", 0.4), ("speech", 0.25), ("quiet", 0.21)])
def test_live_curves_are_those_of_python(
    page: SpeechPage, speech: Float32Array, clip: str, lookahead: float
) -> None:
    samples = clips(speech)[clip][: 2 * SPEECH_RATE]
    check_replayed(page, samples, [320] * (len(samples) // 320), lookahead=lookahead)


def test_live_curves_of_another_rate_are_those_of_python(
    page: SpeechPage, speech: Float32Array
) -> None:
    samples = np.interp(np.arange(44_100) * 16 / 44.1, np.arange(len(speech)), speech)
    blocks = [1000] * 44 + [100]
    check_replayed(page, samples.astype(np.float32), blocks, rate=44_100, lookahead=0.3)


def test_bands_are_those_of_python(page: SpeechPage, speech: Float32Array) -> None:
    quiet = clips(speech)["quiet"]
    page.give("samples", quiet)
    got = page.run("""
        const { Mel, tables, floats } = elocute, samples = await floats("samples");
        const mel = new Mel(tables.mel, 4);
        return [...mel.push(samples.subarray(0, 777)), ...mel.push(samples.subarray(777))];
    """)
    assert np.abs(np.array(got) - WhisperMel().push(quiet).ravel()).max() < 1e-4


@pytest.mark.parametrize("rate", [48_000, 44_100, 8_000])
def test_sound_of_other_rates_is_that_of_python(page: SpeechPage, rate: int) -> None:
    sound = np.random.default_rng(2).standard_normal(rate // 4).astype(np.float32) * np.float32(
        0.25
    )
    page.give("samples", sound)
    wanted = ResamplingStream(rate, SPEECH_RATE).push(sound, last=True)
    got = page.run(
        """
        const { Resampler, tables, floats } = elocute, samples = await floats("samples");
        const stream = new Resampler(tables.resampling, given[0], 16000, false);
        const parts = [samples.subarray(0, 99), samples.subarray(99), samples.subarray(0, 0)];
        return parts.flatMap((part, at) => [...stream.push(part, at === 2)]);
        """,
        rate,
    )
    count = min(len(got), len(wanted))
    assert abs(len(got) - len(wanted)) <= 1
    # White noise, of which a hundredth lies where the filters fall, and there a little apart.
    assert np.sqrt(np.mean((np.array(got[:count]) - wanted[:count]) ** 2)) < 1e-3


def test_whole_numbers_are_multiplied_exactly(page: SpeechPage) -> None:
    draw = np.random.default_rng(3)
    left = draw.integers(0, 256, (7, 1536), dtype=np.uint8)
    right = draw.integers(-63, 64, (1536, 40), dtype=np.int8)
    page.give("left", left)
    page.give("right", right)
    page.give("product.onnx", np.frombuffer(product_graph(left, right), np.uint8))
    got = page.run("""
        const { ort, bytes } = elocute, network = new Uint8Array(await bytes("product.onnx"));
        const session = await ort.InferenceSession.create(network);
        const left = new ort.Tensor("uint8", new Uint8Array(await bytes("left")), [7, 1536]);
        const right = new ort.Tensor("int8", new Int8Array(await bytes("right")), [1536, 40]);
        return [...(await session.run({ left, right })).product.data];
    """)
    assert (np.reshape(got, (7, 40)) == (left.astype(int) - 128) @ right.astype(int)).all()


def product_graph(left: np.ndarray, right: np.ndarray) -> bytes:
    """A network of one `MatMulInteger`, its zero the trunk's."""
    helper, types = onnx.helper, onnx.TensorProto
    zero = helper.make_tensor("zero", types.UINT8, [], [128])
    node = helper.make_node("MatMulInteger", ["left", "right", "zero"], ["product"])
    inputs = [
        helper.make_tensor_value_info("left", types.UINT8, left.shape),
        helper.make_tensor_value_info("right", types.INT8, right.shape),
    ]
    shape = (left.shape[0], right.shape[1])
    outputs = [helper.make_tensor_value_info("product", types.INT32, shape)]
    graph = helper.make_graph([node], "product", inputs, outputs, [zero])
    opset = helper.make_opsetid("", 20)
    return helper.make_model(graph, opset_imports=[opset], ir_version=9).SerializeToString()


def check_near(page: SpeechPage, samples: Float32Array) -> None:
    """Whether the browser's own curves are as near to Python's as roundings let them be."""
    page.give("samples", samples)
    whole, cut = (
        page.run("return elocute.spoken(await elocute.floats('samples'), given[0], {})", size)
        for size in (len(samples), 1111)
    )
    wanted = elocute.animate(samples, rate=SPEECH_RATE, life=0).curves.values
    assert np.abs(np.array(cut) - whole).max() < 1e-5
    apart = np.abs(np.array(whole).reshape(wanted.shape) - wanted).max(axis=1)
    # A contact that is as likely as not comes or does not: few frames may be apart.
    assert np.median(apart) < 0.01 and np.quantile(apart, 0.9) < 0.05


def test_the_whole_path_is_near_to_that_of_python(page: SpeechPage, speech: Float32Array) -> None:
    check_near(page, speech)


@pytest.mark.shared_data
@pytest.mark.parametrize("name", ["grid_s1/clips/bbal7s.ogg", "talkers/dev/clips/edtalk_pose2.ogg"])
def test_people_are_heard_as_in_python(page: SpeechPage, shared_data: Path, name: str) -> None:
    samples = read_audio(shared_data / name, sample_rate=SPEECH_RATE).samples
    check_near(page, samples[: 3 * SPEECH_RATE])


def test_what_cannot_be_used_is_told(page: SpeechPage) -> None:
    told = page.run("""
        const { createSpeech, ort, tables, session } = elocute, messages = [];
        const told = (error) => messages.push(error.message);
        const tell = async (work) => { try { await work(); } catch (error) { told(error); } };
        const open = (settings) => createSpeech({ ort, trunk: session, tables, ...settings });
        await tell(() => open({ lookahead: 0.1 }));
        await tell(() => open({ style: "sung" }));
        await tell(() => open({ trunk: "/nothing.onnx" }));
        const speech = await open({});
        await tell(() => speech.push([0, 0]));
        await tell(() => speech.push(new Float32Array([NaN])));
        await speech.flush();
        await tell(() => speech.push(new Float32Array(1)));
        return messages;
    """)
    assert [message.split(":")[0] for message in told] == [
        "lookahead", "style", "/nothing.onnx", "push", "push", "push",
    ]  # fmt: skip
    assert told[0] == "lookahead: found 0.1; allowed: 0.21 to 10"
