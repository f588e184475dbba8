"""A trained VOCA at run time: features and a mix of styles in, weights of shapes out.

ONNX alone, no torch. The file says which encoder it hears with, how its styles are called and
what its weights weigh; nothing in it is executed but the network.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.audio.features import Features
from elocute.errors import ModelError
from elocute.synthesis.trained_file import check_file, open_session, run_session, stored_record

Array = NDArray[np.float32]
SHIPPED = "voca"
SHIPPED_PATH = Path(__file__).parent / "assets" / "voca.onnx"
BLOCK_FRAMES = 7200  # two minutes in one run of the network: memory stays bounded
FPS_MAX, FEATURES_MAX, STYLES_MAX = 1000.0, 100_000, 10_000
REACH = 16  # frames that a window sees: blocks overlap by so many on both sides


@dataclass(frozen=True)
class VocaRecord:
    """What training wrote into the file.

    components  names of the weights where they are those of a known head, () where the file
                carries its own basis
    topology    the head whose mesh it moves, or ""
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
    """`voca`, the one that ships, or a file of one's own.

    Raises ModelError where the file is missing, too large or no VOCA of Elocute.
    """

    def __init__(self, path: str | Path, session: Any = None) -> None:
        self.path = SHIPPED_PATH if str(path) == SHIPPED else Path(path)
        self._opened = session  # of the same file, where it was opened before
        check_file(self.path, "make one: elocute train voca CORPUS -o FOLDER")

    @cached_property
    def _session(self) -> Any:
        return self._opened or open_session(self.path)

    @cached_property
    def record(self) -> VocaRecord:
        stored = stored_record(self._session)
        try:
            if stored["kind"] != "voca":
                raise ValueError(stored["kind"])
            record = VocaRecord(
                str(stored["encoder"]), float(stored["fps"]), tuple(map(str, stored["styles"])),
                int(stored["features"]), tuple(map(str, stored["components"])),
                str(stored["topology"]), int(stored["vertices"]), str(stored["note"]),
            )  # fmt: skip
            if not 0 < record.fps <= FPS_MAX or not 1 <= record.features <= FEATURES_MAX:
                raise ValueError("fps or features out of range")
            if not 1 <= len(record.styles) == len(set(record.styles)) <= STYLES_MAX:
                raise ValueError("no styles, or one twice")
            return record
        except (ValueError, KeyError, TypeError, OverflowError) as error:
            raise ModelError.about(
                self.path, found="an ONNX file without Elocute's record",
                allowed="a model that elocute train wrote",
            ) from error  # fmt: skip

    def style_vector(self, shares: dict[str, float]) -> Array:
        """(style,) of named shares. Raises ModelError for a style it never learned."""
        vector = np.zeros(len(self.record.styles), np.float32)
        for name, share in shares.items():
            if name not in self.record.styles:
                raise ModelError.about(
                    f"style {name[:60]!r}", found=f"not in {self.path.name}",
                    allowed=", ".join(self.record.styles) + ", or a mix (a:0.7,b:0.3)",
                )  # fmt: skip
            vector[self.record.styles.index(name)] = share
        return vector

    @property
    def even_style(self) -> Array:
        """(style,) all styles alike: the middle of what was learned."""
        count = len(self.record.styles)
        return np.full(count, 1 / count, np.float32)

    def weights(self, features: Features, style: Array) -> Array:
        """(frame, component) at the model's frame rate.

        Raises ModelError for features of another size than it was trained on.
        """
        values = features.resample(self.record.fps).values
        if values.shape[1] != self.record.features:
            raise ModelError.about(
                self.path, found=f"{values.shape[1]} features from {features.encoder}",
                allowed=f"{self.record.features} ({self.record.encoder})",
            )  # fmt: skip
        blocks = []
        for start in range(0, len(values), BLOCK_FRAMES):
            begin = max(0, start - REACH)
            stop = min(len(values), start + BLOCK_FRAMES)
            window = values[begin : stop + REACH]
            given = {"features": window, "style": style[None].astype(np.float32)}
            block = run_session(self._session, self.path, ["weights"], given)[0]
            if getattr(block, "ndim", 0) != 2 or len(block) != len(window):
                raise ModelError.about(
                    self.path, found="a network of another form", allowed="(frame, component)"
                )
            blocks.append(block[start - begin : stop - begin])
        return np.concatenate(blocks)

    @cached_property
    def basis(self) -> Array | None:
        """(component, vertex, 3) m of a model that carries its own, or None."""
        if self.record.components:
            return None
        given = {
            "features": np.zeros((REACH, self.record.features), np.float32),
            "style": self.even_style[None],
        }
        basis = run_session(self._session, self.path, ["basis"], given)[0]
        if getattr(basis, "ndim", 0) != 3 or basis.shape[1:] != (self.record.vertices, 3):
            raise ModelError.about(
                self.path, found="a basis of another form",
                allowed=f"(component, {self.record.vertices}, 3)",
            )  # fmt: skip
        return basis
