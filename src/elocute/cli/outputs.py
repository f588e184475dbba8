"""What commands share about their outputs: planned before any work, then written."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable
from pathlib import Path
from typing import TYPE_CHECKING, Any

from elocute.cli.formats import Drawing, drawing_of
from elocute.files.output_plan import OutputPlan

if TYPE_CHECKING:
    from elocute.files.output_history import Source
    from elocute.motion.motion import Motion


def settled(plan: OutputPlan, overwrite: bool, no_clobber: bool, as_json: bool = False) -> bool:
    """Check a plan and say what is left as it is; True where nothing is left to be done."""
    plan.check(overwrite=overwrite, no_clobber=no_clobber)
    for path in plan.kept:
        print(f"elocute: {path}: exists already; left as it is", file=sys.stderr)
    if plan.finished and as_json:
        print(json.dumps({"outputs": [], "kept": [str(path) for path in plan.kept]}))
    return plan.finished


def plan_files(
    inputs: Iterable[Source], outputs: Iterable[Path | None], overwrite: bool, no_clobber: bool
) -> OutputPlan:
    """A checked plan of files that are all made from all inputs; None is no file."""
    plan, sources = OutputPlan(), tuple(inputs)
    for path in outputs:
        if path is not None:
            plan.add(path, *sources)
    settled(plan, overwrite, no_clobber)
    return plan


def plan_motion(
    plan: OutputPlan,
    target: Path,
    source: Source,
    *,
    sound: Path | None,
    drawing: Drawing,
    cut: bool = False,
) -> None:
    """Plan a motion of `source` as a file, with what is written beside it. Raises InputError."""
    from elocute.export.registry import check_suffix, side_files

    check_suffix(target)
    plan.add(target, source)
    for side in side_files(target, sound, embed_audio=_embeds(drawing), cut=cut):
        plan.add(side, sound or source, beside=target)


def write_motion(
    plan: OutputPlan,
    motion: Motion,
    target: Path,
    *,
    sound: Any,
    progress: Any,
    drawing: Drawing,
) -> None:
    """Write what `plan_motion` planned."""
    from elocute.export.registry import side_files, write

    sides = side_files(target, sound, embed_audio=_embeds(drawing))
    heard = sound if all(map(plan.wants, sides)) else None
    with plan.writing(target):
        more = drawing_of(target, drawing)
        write(motion, target, sound=heard, overwrite=True, progress=progress, **more)


def _embeds(drawing: Drawing) -> bool:
    return drawing.get("embed_audio", False)


def tell_silent(targets: Iterable[Path], remedy: str) -> None:
    """One line for outputs that could carry sound and do not, since none was given."""
    from elocute.export.registry import WRITERS

    silent = [path.name for path in targets if WRITERS[path.suffix.lower()].has_sound]
    if silent:
        told = f"{', '.join(silent)}: without sound; {remedy}"
        print(f"elocute: {told}", file=sys.stderr)
