"""What `render` does with a project of the studio."""

from __future__ import annotations

import json
from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

from elocute.cli.format_options import FormatSettings, check_format_settings, settings_for_format
from elocute.cli.outputs import nothing_to_do, plan_motion
from elocute.cli.takes import TakeOutputs, make_outputs
from elocute.errors import InputError
from elocute.export.registry import check_suffix
from elocute.files.output_plan import OutputPlan

if TYPE_CHECKING:
    from elocute.animation import Animation


def check_project_alone(path: Path, others: Mapping[str, Any]) -> None:
    """Raise InputError for an option that a project says itself."""
    for flag, value in others.items():
        if value is not None:
            raise InputError.about(
                flag,
                found=f"a project, {path.name}",
                allowed="for a motion; a project says it itself",
            )


def render_project(
    path: Path,
    outputs: Sequence[Path],
    fps: float | None,
    format_settings: FormatSettings,
    existing: tuple[bool, bool],
    as_json: bool,
) -> None:
    """Animate a project and write its outputs; existing: whether files are replaced, or kept."""
    from elocute.studio.project import open_project

    project = open_project(path)
    for target in outputs:
        check_suffix(target)
    check_format_settings(outputs, format_settings)
    named = [name for name in (project.sound, project.character) if name]
    plan = OutputPlan([project.folder / name for name in named])
    chosen = {}
    for target in outputs:
        given = settings_for_format(target, format_settings)
        chosen |= project.options_of(target) | given
    sound = project.file(project.sound)
    for target in outputs:
        plan_motion(plan, target, path, sound=sound, format_settings=chosen)
    if nothing_to_do(plan, *existing, as_json):
        return

    def make(progress: Any) -> Animation:
        made = project.animate(progress)
        return made if fps is None else replace(made, motion=made.motion.at_fps(fps))

    targets = plan.wanted(outputs)
    told = make_outputs(
        make,
        targets,
        TakeOutputs(plan, (), chosen, as_json),
        label=f"animating {path.name}",
        about=f"{path}: ",
    )
    if as_json:
        print(json.dumps({"input": str(path), "outputs": list(map(str, targets)), **told}))
