"""From a checkpoint to the shipped ONNX file."""

from __future__ import annotations

import json
import warnings
from pathlib import Path

import onnx
import torch
from torch import Tensor, nn

from elocute.audio import front_end
from elocute.audio.phones_and_visemes import PHONES
from elocute.audio.waveform import SPEECH_RATE
from elocute.networks.phone_net import PhoneNet, PhoneNetConfig


class _LogPosteriors(nn.Module):
    def __init__(self, net: PhoneNet) -> None:
        super().__init__()
        self.net = net

    def forward(self, features: Tensor) -> Tensor:
        return torch.log_softmax(self.net(features), dim=-1)


def load_net(checkpoint: Path) -> PhoneNet:
    """The averaged network of a checkpoint, ready to hear."""
    state = torch.load(checkpoint, weights_only=True)
    config = dict(state["config"])
    config["blocks"] = tuple(tuple(block) for block in config["blocks"])
    net = PhoneNet(PhoneNetConfig(**config))
    net.load_state_dict(state["ema"])
    return net.eval()


def export(net: PhoneNet, path: Path, thresholds: dict[str, float]) -> None:
    """Write ONNX with its configuration inside."""
    draft = path.with_suffix(".draft")
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        torch.onnx.export(
            _LogPosteriors(net),
            (torch.zeros(1, 400, front_end.BANDS),),
            str(draft),
            input_names=["features"],
            output_names=["log_posteriors"],
            dynamic_axes={"features": {1: "frame"}, "log_posteriors": {1: "phone_frame"}},
            opset_version=17,
            dynamo=False,
        )
    model = onnx.load(draft)
    entry = model.metadata_props.add()
    entry.key = "elocute"
    entry.value = json.dumps(
        {
            "encoder": "phones",
            "phones": PHONES,
            "rate_hz": 50,
            "sample_rate_hz": SPEECH_RATE,
            "bands": front_end.BANDS,
            "mean_s": front_end.MEAN_S,
            "history_frames": net.config.history_frames,
            "lookahead_frames": net.config.lookahead_frames,
            "thresholds": thresholds,
        }
    )
    onnx.save(model, draft)
    draft.replace(path)
