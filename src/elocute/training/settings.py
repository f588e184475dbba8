"""What the settings of every training have in common: they are checked, and have presets."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Self

from elocute.errors import ModelError
from elocute.one_line_repr import brief
from elocute.settings import check_settings


class TrainingSettings:
    """Checked when made; a dataclass of settings is derived from it."""

    presets: ClassVar[Mapping[str, Mapping[str, object]]]
    """Settings that differ from the defaults, by the name of the preset; the first is none."""

    def __post_init__(self) -> None:
        check_settings(self, ModelError)

    @classmethod
    def preset(cls, name: str, **changes: Any) -> Self:
        """The settings of a preset, with changes. Raises ModelError for a name of none."""
        if name not in cls.presets:
            raise ModelError.about("`preset`", found=brief(name), allowed=", ".join(cls.presets))
        return cls(**{**cls.presets[name], **changes})
