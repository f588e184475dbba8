"""Motions as files: a writer for each suffix, and the options of its format."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.export.arkit_csv import arkit_curves
    from elocute.export.converted_curves import Conversion, convert_curves, write_curves
    from elocute.export.curve_files import CurveFile, read_curves
    from elocute.export.curves_json import read_json_curves
    from elocute.export.options import GlbOptions, HtmlOptions, PictureOptions
    from elocute.export.registry import WRITERS, Format, check_suffix, format_options, write

__all__ = [
    "WRITERS",
    "Conversion",
    "CurveFile",
    "Format",
    "GlbOptions",
    "HtmlOptions",
    "PictureOptions",
    "arkit_curves",
    "check_suffix",
    "convert_curves",
    "format_options",
    "read_curves",
    "read_json_curves",
    "write",
    "write_curves",
]
__getattr__, __dir__ = lazy(
    __name__,
    {
        "arkit_csv": ("arkit_curves",),
        "converted_curves": ("Conversion", "convert_curves", "write_curves"),
        "curve_files": ("CurveFile", "read_curves"),
        "curves_json": ("read_json_curves",),
        "options": ("GlbOptions", "HtmlOptions", "PictureOptions"),
        "registry": ("WRITERS", "Format", "check_suffix", "format_options", "write"),
    },
)
