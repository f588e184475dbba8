"""How much faster the recurrent network is when windows share what they can.

    python -m benchmarks.crnn [--seconds 5] [--model FILE.onnx]
    python -m benchmarks.crnn --columns 4300

One thread, the same run, the same 41 x 128 x 3 windows of the shipped example. "Window by window"
is the network of the paper asked for one window at a time (in torch, and in onnxruntime), "all
windows at once" gives it all of them in one batch; the shared forms compute every column and the
first convolution over time once. The largest difference of any output is printed beside.

The network acts on 1230 columns a second window by window, and on 100 when they are shared, so
12.3 times is all that sharing itself can give; what is more comes from long runs instead of short.

--columns times what a training step computes of so many columns, forward and backward: all at
once, and in blocks that stay in the cache. A batch of 50 words has about 4300.
"""

from __future__ import annotations

import argparse
import os
import tempfile
import time
import warnings
from collections.abc import Callable
from pathlib import Path

os.environ["OMP_NUM_THREADS"] = "1"

import numpy as np
import onnxruntime
import torch

from elocute.audio.mel_with_deltas import BANDS, mel_columns
from elocute.audio.read import read_audio
from elocute.audio.waveform import Waveform
from elocute.models.crnn_network import CrnnNetwork, stream_weights
from elocute.networks.crnn import BLOCK, COLUMNS, Crnn, SharedCrnn, with_slopes
from elocute.training.crnn.run import StreamingCrnn
from elocute.training.onnx_export import OPSET

EXAMPLE = Path(__file__).parents[1] / "src" / "elocute" / "assets" / "example.flac"


class _Alone(torch.nn.Module):
    """One window and the state of the LSTM."""

    def __init__(self, network: Crnn) -> None:
        super().__init__()
        self.network = network

    def forward(self, windows, hidden, cell):
        out, (hidden, cell) = self.network(windows, (hidden, cell))
        return out, hidden, cell


def timed(run: Callable[[], np.ndarray], times: int) -> tuple[float, np.ndarray]:
    """Least CPU seconds of some runs, and what came out: a busy machine changes them little."""
    found, best = run(), float("inf")
    for _ in range(times):
        begun = time.process_time()
        found = run()
        best = min(best, time.process_time() - begun)
    return best, found


def one_by_one(windows: torch.Tensor, ask: Callable) -> np.ndarray:
    state, parts = (torch.zeros(1, 1, 128), torch.zeros(1, 1, 128)), []
    for index in range(windows.shape[1]):
        out, state = ask(windows[:, index : index + 1], state)
        parts.append(np.asarray(out)[0])
    return np.concatenate(parts)


def session(module: torch.nn.Module, given: tuple, names: list[str], free: dict, folder: str):
    """The module in onnxruntime, one thread."""
    path = f"{folder}/{type(module).__name__}.onnx"
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        torch.onnx.export(
            module,
            given,
            path,
            input_names=names,
            opset_version=OPSET,
            output_names=["y", "h", "c"],
            dynamic_axes=free,
            dynamo=False,
        )
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = options.inter_op_num_threads = 1
    return onnxruntime.InferenceSession(path, options, providers=["CPUExecutionProvider"])


def time_columns(count: int, times: int) -> None:
    """Print how long convolutions over frequency take forward and backward, in both forms."""
    network, values = Crnn(), torch.randn(1, count, BANDS, 3)

    def stepped(form: Callable[[torch.Tensor], torch.Tensor]) -> np.ndarray:
        network.zero_grad()
        out = form(values)
        out.square().sum().backward()
        return out.detach().numpy()

    whole, expected = timed(lambda: stepped(network.columns), times)
    blocks, found = timed(lambda: stepped(network.columns_in_blocks), times)
    print(
        f"{count} columns, forward and backward: {whole * 1000:.0f} ms at once, "
        f"{blocks * 1000:.0f} ms in blocks of {BLOCK}: {whole / blocks:.1f} x, "
        f"largest difference {np.abs(found - expected).max():.1e}"
    )


@torch.no_grad()
def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("--seconds", type=float, default=5.0)
    parser.add_argument("--times", type=int, default=3)
    parser.add_argument("--model", type=Path, help="also time a whole recording with this model")
    parser.add_argument("--columns", type=int, help="time these of a training step, nothing else")
    choice = parser.parse_args()
    torch.set_num_threads(1)
    torch.manual_seed(0)
    if choice.columns:
        with torch.enable_grad():
            time_columns(choice.columns, choice.times)
        return
    whole = read_audio(EXAMPLE)
    sound = Waveform(whole.samples[: round(choice.seconds * whole.sample_rate)], whole.sample_rate)
    heard = mel_columns(sound)
    network, shared = Crnn().eval(), None
    network.shift.fill_(-6.0)
    network.scale.fill_(4.0)
    shared = SharedCrnn(network)
    static, starts = torch.from_numpy(heard.static), torch.from_numpy(heard.starts)
    windows = with_slopes(static[None])[0][starts[:, None] + torch.arange(COLUMNS)][None]
    zero = torch.zeros(1, 1, 128)
    with tempfile.TemporaryDirectory() as room:
        alone = session(
            _Alone(network).eval(),
            (windows[:, :2], zero, zero),
            ["windows", "hidden", "cell"],
            {"windows": {1: "frame"}},
            room,
        )
        stream = session(
            StreamingCrnn(shared).eval(),
            (static, starts, zero, zero),
            ["columns", "starts", "hidden", "cell"],
            {"columns": {0: "column"}, "starts": {0: "frame"}},
            room,
        )

    def ask(window, state):
        given = dict(zip(("windows", "hidden", "cell"), (window, *state), strict=True))
        out, hidden, cell = alone.run(None, {k: np.asarray(v) for k, v in given.items()})
        return out, (hidden, cell)

    given = {
        "columns": heard.static,
        "starts": heard.starts,
        "hidden": zero.numpy(),
        "cell": zero.numpy(),
    }
    rows: dict[str, tuple[float, np.ndarray]] = {
        "torch, window by window": timed(lambda: one_by_one(windows, network), choice.times),
        "torch, all windows at once": timed(lambda: network(windows)[0][0].numpy(), choice.times),
        "torch, shared": timed(
            lambda: shared(static[None], starts[None])[0][0].numpy(), choice.times
        ),
        "onnxruntime, window by window": timed(lambda: one_by_one(windows, ask), choice.times),
        "onnxruntime, shared (run time)": timed(
            lambda: np.asarray(stream.run(None, given)[0]), choice.times
        ),
    }
    true = rows["torch, window by window"][1]
    print(
        f"{len(starts)} windows, {choice.seconds:g} s of sound, CPU time of one thread, "
        f"least of {choice.times}"
    )
    print("| form | ms | largest difference |\n|---|---|---|")
    for name, (seconds, found) in rows.items():
        print(f"| {name} | {seconds * 1000:.1f} | {np.abs(found - true).max():.1e} |")
    spent = {name: seconds for name, (seconds, _) in rows.items()}
    for slow, fast in (
        ("torch, window by window", "torch, shared"),
        ("torch, all windows at once", "torch, shared"),
        ("onnxruntime, window by window", "onnxruntime, shared (run time)"),
        ("torch, window by window", "onnxruntime, shared (run time)"),
    ):
        print(f"{fast} against {slow}: {spent[slow] / spent[fast]:.1f} x")
    if choice.model:
        model = CrnnNetwork(choice.model)
        seconds, _ = timed(lambda: stream_weights(model, whole), choice.times)
        print(f"a recording of {whole.duration_s:.1f} s, mel columns and network: {seconds:.3f} s")


if __name__ == "__main__":
    main()
