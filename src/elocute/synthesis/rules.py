"""The rule-based driver, seen as a model with styles: what `style fit` asks of a trained one."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.articulation.driver import articulate
from elocute.articulation.style import STYLES, mix_styles
from elocute.audio.features import Features
from elocute.audio.phones import PHONES
from elocute.head.builtin import load_builtin_head
from elocute.synthesis.voca import VocaModel, VocaRecord

Array = NDArray[np.float32]
FPS = 60.0


def _record() -> VocaRecord:
    head = load_builtin_head()
    return VocaRecord(
        "phones", FPS, tuple(STYLES), len(PHONES), head.expression_names, head.name,
        head.vertex_count, "the driver",
    )  # fmt: skip


@dataclass(frozen=True)
class RuleModel:
    """Answers as a VocaModel does; nobody blinks, as blinks cannot be heard."""

    path: Path = Path("articulation")
    record: VocaRecord = field(default_factory=_record)

    def weights(self, features: Features, style: Array) -> Array:
        """(frame, component) at the model's frame rate, for shares (style,) of STYLES."""
        heard = features.resample(FPS)
        shares = dict(zip(self.record.styles, map(float, style), strict=True))
        mixed = replace(mix_styles(shares), blink_per_min=0.0)
        curves = articulate(heard.values, FPS, frame_count=len(heard.values), fps=FPS, style=mixed)
        return curves.select(self.record.components).values

    @property
    def basis(self) -> None:
        """The built-in head's shapes."""


Styled = VocaModel | RuleModel


def open_styled(model: str | Path) -> Styled:
    """`articulation`, `voca` or a trained model (.onnx). Raises ModelError."""
    return RuleModel() if str(model) == "articulation" else VocaModel(model)
