"""Motions as files: a writer for each suffix, and the options of its format."""

from __future__ import annotations

from typing import TYPE_CHECKING

from elocute.lazy_loading import lazy

if TYPE_CHECKING:
    from elocute.export.arkit_csv import arkit_curves as arkit_curves
    from elocute.export.curve_files import CurveFile as CurveFile, read_curves as read_curves
    from elocute.export.curves_json import (
        read_json_curves as read_json_curves,
        write_curves as write_curves,
    )
    from elocute.export.html import head_page as head_page
    from elocute.export.options import (
        GlbOptions as GlbOptions,
        HtmlOptions as HtmlOptions,
        PictureOptions as PictureOptions,
    )
    from elocute.export.registry import (
        WRITERS as WRITERS,
        Format as Format,
        check_suffix as check_suffix,
        format_options as format_options,
        write as write,
    )
    from elocute.export.shape_profiles import (
        Conversion as Conversion,
        convert_curves as convert_curves,
    )

__getattr__, __dir__ = lazy(__name__, __file__)
