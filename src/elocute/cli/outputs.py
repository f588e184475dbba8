"""Outputs of commands: planned and checked before any work, then written."""

from __future__ import annotations

import json
import sys
from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from elocute.cli.format_options import FormatSettings, settings_for_format
from elocute.cli.progress import progress_bar
from elocute.errors import OutputError
from elocute.files.output_plan import OutputPlan

if TYPE_CHECKING:
    from elocute.files.output_history import Source
    from elocute.motion.motion import Motion


def check_file_suffix(path: Path | None, *allowed: str) -> None:
    """Raise OutputError for an output with another suffix than these; None is no output."""
    if path is not None and path.suffix.lower() not in map(str.lower, allowed):
        raise OutputError.about(path, found=f"suffix {path.suffix!r}", allowed=" ".join(allowed))


def check_plan(plan: OutputPlan, overwrite: bool, no_clobber: bool) -> None:
    """Check a plan, and say which files are kept. Raises OutputError for what is in the way."""
    plan.check(overwrite=overwrite, no_clobber=no_clobber)
    for path in plan.kept:
        print(f"elocute: {path}: exists already; left as it is", file=sys.stderr)


def nothing_to_do(
    plan: OutputPlan, overwrite: bool, no_clobber: bool, as_json: bool = False
) -> bool:
    """Check a plan; whether all its files are kept, which is then the command's result."""
    check_plan(plan, overwrite, no_clobber)
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
    check_plan(plan, overwrite, no_clobber)
    return plan


def plan_motion(
    plan: OutputPlan,
    target: Path,
    source: Source,
    *,
    sound: Path | None,
    format_settings: FormatSettings,
    cut: bool = False,
) -> None:
    """Plan a motion of `source` as a file, with what is written beside it. Raises InputError."""
    from elocute.export.registry import check_suffix, side_files
    from elocute.render.background import background_file

    check_suffix(target)
    chosen = settings_for_format(target, format_settings)
    behind = background_file(chosen.get("background"))
    grown = chosen.get("add", False)
    plan.add(target, source, *([] if behind is None else [behind]), grown=grown)
    for side in side_files(target, sound, chosen, cut=cut):
        plan.add(side, sound or source, beside=target)


def write_motion(
    plan: OutputPlan,
    motion: Motion,
    target: Path,
    *,
    sound: Any,
    progress: Any,
    format_settings: FormatSettings,
    words: Sequence[tuple[float, float, str]] = (),
) -> None:
    """Write what `plan_motion` planned; words: those that are known, with their times in s."""
    from elocute.export.registry import side_files, write

    more = settings_for_format(target, format_settings)
    sides = side_files(target, sound, more)
    heard = sound if all(map(plan.wants, sides)) else None
    with plan.writing(target):
        write(motion, target, sound=heard, words=words, overwrite=True, progress=progress, **more)


def write_motions(
    plan: OutputPlan,
    motion: Motion,
    targets: Iterable[Path],
    *,
    sound: Any,
    format_settings: FormatSettings,
    silence: str,
    quiet: bool,
) -> None:
    """Write what `plan_motion` planned, one after another, and name each; silence: its remedy."""
    for target in targets:
        with progress_bar(f"writing {target.name}", quiet) as progress:
            write_motion(
                plan,
                motion,
                target,
                sound=sound,
                progress=progress,
                format_settings=format_settings,
            )
        if not quiet:
            print(target)
    if sound is None:
        alone = [each for each in targets if _could_sound(each, format_settings)]
        warn_of_silence(alone, silence)


def _could_sound(target: Path, format_settings: FormatSettings) -> bool:
    """Whether an output could carry the sound: one of many takes, or a take alone, never does."""
    from elocute.export.registry import WITHOUT_SOUND_BESIDE

    chosen = settings_for_format(target, format_settings)
    return chosen.get("embed_audio") or not any(map(chosen.get, WITHOUT_SOUND_BESIDE))


def warn_of_silence(targets: Iterable[Path], remedy: str) -> None:
    """Say which outputs could carry sound and do not, since none was given."""
    from elocute.export.registry import WRITERS

    silent = [path.name for path in targets if WRITERS[path.suffix.lower()].has_sound]
    if silent:
        warning = f"{', '.join(silent)}: without sound; {remedy}"
        print(f"elocute: {warning}", file=sys.stderr)


def write_json_report(path: Path, text: str) -> None:
    """Write the text of a JSON record, whole or not at all. Raises OutputError."""
    from elocute.files.atomic import write_atomically

    with write_atomically(path) as draft:
        draft.write_text(text + "\n", encoding="utf-8")
