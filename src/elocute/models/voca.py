"""A trained VOCA at run time: features and a mix of styles in, weights of shapes out.

Regression averages over what it is unsure of and so leaves lips a little open where they should
meet: on the built-in head the driver's contacts and rests come after the network.

ONNX alone, no torch. The file states its encoder, the names of its styles and the shapes that its
weights apply to; nothing in it is executed but the network.
"""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from elocute.array_types import Float32Array
from elocute.articulation.driver import LOOKAHEAD_S
from elocute.articulation.style import Style
from elocute.audio.features import Features
from elocute.audio.resampling_stream import RESAMPLING_S
from elocute.audio.waveform import Waveform
from elocute.encoders.registry import resolve_encoder
from elocute.encoders.trunk import builtin_trunk, trunk_lookahead_s
from elocute.errors import ModelError
from elocute.head.model import HeadModel
from elocute.models.feature_extraction import (
    HeardMiddle,
    Hearing,
    PhonePosteriorStream,
    WholeSoundStream,
)
from elocute.models.finishing import finished_curves
from elocute.models.model_file import check_file, open_session, run_session, stored_record
from elocute.models.model_shapes import with_own_shapes
from elocute.models.protocol import FeatureStreams, FrameSpan, SoundLevel, SpeechFeatures
from elocute.models.style_errors import StyleErrors
from elocute.models.style_mixes import (
    MixedStyle,
    mix_of_shares,
    share_vector,
    style_shares,
    style_vector,
)
from elocute.motion.curves import Curves
from elocute.motion.motion import FPS_MAX
from elocute.numerics.resampling import frame_places, read_rows

SHIPPED = "voca"
SHIPPED_PATH = Path(__file__).parent / "assets" / "voca.onnx"
BLOCK_FRAMES = 7200  # two minutes in one run of the network: memory stays bounded
FEATURES_MAX, STYLES_MAX = 100_000, 10_000
REACH = 16  # frames that a window sees: blocks overlap by so many on both sides


@dataclass(frozen=True)
class VocaRecord:
    """What training wrote into the file: the network's encoder, frame rate, styles and head.

    `features` is how many there are in a row. Components are names of the weights where they are
    those of a known head, and () where the file has its own basis; topology is the head whose mesh
    it moves, or "", and `vertices` how many that has. The note is by the person who trained it.
    """

    encoder: str
    fps: float
    styles: tuple[str, ...]
    features: int
    components: tuple[str, ...]
    topology: str
    vertices: int
    note: str


class VocaModel:
    """The VOCA that ships (`voca`), or a trained one from an .onnx, as a SpeechModel.

    A session may be given where the file was opened before.

    Raises
    ------
    ModelError
        For a file that is missing or too large; when the network is first used, for one that is
        not a VOCA of Elocute.
    """

    kind = "voca"
    least_rows = REACH  # that the network takes
    needs_sound_level = False
    live_lookahead_s = math.inf

    def __init__(self, path: str | Path = SHIPPED, session: Any = None) -> None:
        self.path = SHIPPED_PATH if str(path) == SHIPPED else Path(path)
        self._opened = session  # of the same file, where it was opened before
        check_file(self.path, f"make one: elocute train {self.kind} CORPUS -o FOLDER")

    @cached_property
    def _session(self) -> Any:
        return self._opened or open_session(self.path)

    @cached_property
    def record(self) -> VocaRecord:
        stored = stored_record(self._session)
        try:
            if stored["kind"] != self.kind:
                raise ValueError(stored["kind"])
            record = VocaRecord(
                encoder=str(stored["encoder"]),
                fps=float(stored["fps"]),
                styles=tuple(map(str, stored["styles"])),
                features=int(stored["features"]),
                components=tuple(map(str, stored["components"])),
                topology=str(stored["topology"]),
                vertices=int(stored["vertices"]),
                note=str(stored["note"]),
            )
            if not 0 < record.fps <= FPS_MAX or not 1 <= record.features <= FEATURES_MAX:
                raise ValueError("fps or features out of range")
            if not 1 <= len(record.styles) == len(set(record.styles)) <= STYLES_MAX:
                raise ValueError("no styles, or one twice")
            return record
        except (ValueError, KeyError, TypeError, OverflowError) as error:
            raise ModelError.about(
                self.path,
                found="an ONNX file without Elocute's record",
                allowed="a model that elocute train wrote",
            ) from error

    @cached_property
    def style_errors(self) -> StyleErrors | None:
        """How it errs in the styles that it learned; None where its file does not say."""
        stored = stored_record(self._session).get("style_errors")
        if stored is None:
            return None
        count = len(self.record.components) if self.basis is None else len(self.basis)
        return StyleErrors.from_record(stored, count)

    @property
    def name(self) -> str:
        return self.path.name

    @property
    def encoder(self) -> str:
        return self.record.encoder

    @property
    def styles(self) -> tuple[str, ...]:
        return self.record.styles

    @property
    def components(self) -> tuple[str, ...]:
        return self.record.components

    @property
    def topology(self) -> str:
        return self.record.topology

    @property
    def vertex_count(self) -> int:
        return self.record.vertices

    @property
    def fps(self) -> float:
        return self.record.fps

    @property
    def makes_contacts(self) -> bool:
        return bool(self.record.components)

    @property
    def decoder_lookahead_s(self) -> float:
        network_s = (REACH / 2 + 2) / self.record.fps
        return max(network_s, LOOKAHEAD_S) if self.makes_contacts else network_s

    @property
    def lookahead_s(self) -> float:
        if self.record.encoder not in ("phones", HeardMiddle.name):
            return float("inf")
        return RESAMPLING_S + trunk_lookahead_s() + self.decoder_lookahead_s

    def style(self, given: str | Style, *, outputs: bool = True) -> MixedStyle:
        """Raises ModelError for an unknown style."""
        vector = style_vector(given, self.styles, self.name)
        if vector is not None:
            return mix_of_shares(vector, outputs=False)
        return mix_of_shares(style_shares(given, self.styles, self.name), outputs=outputs)

    def mix(self, shares: Mapping[str, float], *, outputs: bool = True) -> MixedStyle:
        """Raises ModelError for an unknown style."""
        return mix_of_shares(share_vector(shares, self.styles, self.name), outputs=outputs)

    def feature_streams(
        self,
        sample_rate: int,
        *,
        contacts: bool = True,
        level: SoundLevel | None = None,
        within_s: float | None = None,
    ) -> FeatureStreams:
        if self.record.encoder == "phones":
            return FeatureStreams(PhonePosteriorStream(sample_rate))
        contacts = contacts and self.makes_contacts
        if self.record.encoder == HeardMiddle.name:
            hearing = Hearing(builtin_trunk(), sample_rate, phones=contacts)
            return FeatureStreams(HeardMiddle(hearing), hearing.phones if contacts else None)
        own = WholeSoundStream(sample_rate, resolve_encoder(self.record.encoder))
        return FeatureStreams(own, PhonePosteriorStream(sample_rate) if contacts else None)

    def sound_level(self, sound: Waveform) -> SoundLevel | None:
        """None: its features bring their own normalisation."""

    def weights(self, speech: SpeechFeatures, style: MixedStyle, span: FrameSpan) -> Float32Array:
        """(frame, component), the mix of what each input gives.

        Raises ModelError for features of another size than it was trained on.
        """
        return _mixed(self._weights_of_each(speech, style, span), style)

    def _weights_of_each(
        self, speech: SpeechFeatures, style: MixedStyle, span: FrameSpan
    ) -> Float32Array:
        """(input, frame, component)"""
        features, fps = speech.features, self.record.fps
        if features.values.shape[1] != self.record.features:
            raise ModelError.about(
                self.path,
                found=f"{features.values.shape[1]} features from {features.encoder}",
                allowed=f"{self.record.features} ({self.record.encoder})",
            )
        # The network's frames whose features are known, and those of them that are asked for.
        stop = round((features.first + len(features.values)) * fps / features.rate)
        places = frame_places(span.first, span.count, fps, span.fps)
        first = min(int(places[0]), max(stop - 1, 0))
        last = min(max(stop, 1), int(places[-1]) + 2 + REACH)
        each = self._run(features, style.inputs, first, last)
        return np.stack([read_rows(rows, places - first) for rows in each])

    def _run(self, features: Features, inputs: Float32Array, first: int, last: int) -> Float32Array:
        """(input, frame, component) of the network's frames `first` … `last` - 1."""
        begin = max(0, first - REACH)
        values = features.at(begin, last - begin, self.record.fps)
        blocks = []
        for start in range(first, last, BLOCK_FRAMES):
            stop = min(last, start + BLOCK_FRAMES)
            before = max(0, start - REACH)
            window = values[before - begin : stop + REACH - begin]
            answers = [self._answer(window, style) for style in inputs]
            blocks.append(np.stack(answers)[:, start - before : stop - before])
        return np.concatenate(blocks, axis=1)

    def _answer(self, window: Float32Array, style: Float32Array) -> Float32Array:
        """(frame, component) for features (frame, feature) and a network's input (style,)."""
        arrays = {"features": window, "style": style[None].astype(np.float32)}
        answer = run_session(self._session, self.path, ["weights"], arrays)[0]
        if getattr(answer, "ndim", 0) != 2 or len(answer) != self._frames_of(len(window)):
            raise ModelError.about(
                self.path, found="a network with other outputs", allowed="(frame, component)"
            )
        return answer

    def _frames_of(self, rows: int) -> int:
        """How many frames the network gives for so many rows of features."""
        return rows

    def curves(
        self,
        speech: SpeechFeatures,
        style: MixedStyle,
        span: FrameSpan,
        strength: float = 1.0,
        *,
        contacts: bool = True,
    ) -> Curves:
        """Curves 0…1 of the built-in head, or weights of its own shapes."""
        each = self._weights_of_each(speech, style, span) * np.float32(strength)
        if not self.makes_contacts:
            return Curves(_mixed(each, style), self._own_names, span.fps)
        # Each is limited before they are mixed, so that a mix is that of the animations.
        values = _mixed(np.clip(each, 0, 1), style)
        bare = Curves(values, self.record.components, span.fps)
        phones = speech.phones or speech.features if contacts else None
        return finished_curves(bare, phones, span)

    def rig(self, head: HeadModel) -> HeadModel:
        """Raises ModelError for a head of another topology than it was trained in."""
        if self.basis is None:
            return head
        return with_own_shapes(head, self.basis, self._own_names, self.path)

    @property
    def _own_names(self) -> tuple[str, ...]:
        assert self.basis is not None
        count = len(self.basis) - 1
        return (*(f"{self.kind}{index:03d}" for index in range(count)), f"{self.kind}Mean")

    @property
    def basis(self) -> Float32Array | None:
        """(component, vertex, 3) m of a model that carries its own, or None."""
        return self._basis

    @cached_property
    def _basis(self) -> Float32Array | None:
        if self.record.components:
            return None
        arrays = {
            "features": np.zeros((self.least_rows, self.record.features), np.float32),
            "style": np.full((1, len(self.styles)), 1 / len(self.styles), np.float32),
        }
        basis = run_session(self._session, self.path, ["basis"], arrays)[0]
        if getattr(basis, "ndim", 0) != 3 or basis.shape[1:] != (self.record.vertices, 3):
            raise ModelError.about(
                self.path,
                found="a basis of another shape",
                allowed=f"(component, {self.record.vertices}, 3)",
            )
        return basis


def _mixed(each: Float32Array, style: MixedStyle) -> Float32Array:
    """(frame, component): the mix of (input, frame, component)."""
    if len(each) == 1:
        return each[0]
    return np.einsum("ift,i->ft", each, style.shares)
