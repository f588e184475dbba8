"""Takes of a character that are added to one file: `--into`."""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import typer

from elocute.cli.format_options import INTO, FormatSettings
from elocute.cli.outputs import check_file_suffix
from elocute.errors import InputError, OutputError
from elocute.meshes.gltf_document import SUFFIXES as CHARACTER_SUFFIXES

Into = typer.Option(
    None,
    "--into",
    help="One .glb of a character that the take is added to, as an animation that is called as "
    "--action says, or as the recording. Takes that it has stay; it is made where it is missing.",
)


def with_into(
    format_settings: FormatSettings,
    into: Path | None,
    output: list[Path],
    head: str | None,
    command: str,
) -> FormatSettings:
    """The options of formats with the file that takes are added to.

    Raises InputError where there is neither an output nor such a file, and for a head that is no
    character's file; OutputError for a file that is no .glb.
    """
    if into is None:
        if not output:
            raise InputError.about(
                "--output",
                found="missing",
                allowed="a file or a folder, or --into",
                remedy=f"elocute {command} --help shows how",
            )
        return format_settings
    check_file_suffix(into, ".glb")
    if Path(head or "").suffix.lower() not in (*CHARACTER_SUFFIXES, ".npz"):
        raise InputError.about(
            f"--into {into}",
            found=f"the head {head}",
            allowed=f"--head with a character ({' '.join(CHARACTER_SUFFIXES)})",
            remedy="write the built-in head as .glb once, and take that as --head",
        )
    return {**format_settings, INTO: into}


def named_take(format_settings: FormatSettings, name: str) -> FormatSettings:
    """The same for a take that is called so where no name is given."""
    if INTO not in format_settings or format_settings.get("action"):
        return format_settings
    return {**format_settings, "action": name}


def has_take(into: Path, format_settings: FormatSettings) -> bool:
    """Whether the file has an animation of the take's name that is to stay.

    Raises OutputError for a file that is there and no sound glTF.
    """
    if format_settings.get("replace_action") or not into.exists():
        return False
    from elocute.export.gltf_character import actions_of
    from elocute.meshes.gltf_document import read_gltf

    return format_settings["action"] in actions_of(read_gltf(into, error=OutputError))


def check_names(format_settings: FormatSettings, count: int) -> None:
    """Raise InputError for one name of several takes in one file."""
    if INTO in format_settings and format_settings.get("action") and count > 1:
        raise InputError.about(
            "--action",
            found=f"one name for {count} recordings",
            allowed="with one recording",
            remedy="leave it out: each take is called as its recording, or as a table says",
        )


def leave_out_made(
    work: list[tuple[Path, list[Path]]],
    into: Path,
    settings_of: Callable[[Path], FormatSettings],
    single: bool,
) -> None:
    """Take the file off the outputs of recordings whose takes it has, and tell how many.

    Raises OutputError where there is a single one.
    """
    made = 0
    for file, targets in work:
        if single:
            check_free(settings_of(file))
        elif has_take(into, settings_of(file)):
            targets.remove(into)
            made += 1
    if made:
        print(f"elocute: {into}: {made} of {len(work)} there already", file=sys.stderr)


def check_free(format_settings: FormatSettings) -> None:
    """Raise OutputError where the file has a take of the name, before anything is computed."""
    into = format_settings.get(INTO)
    if into is not None and has_take(into, format_settings):
        raise OutputError.about(
            into,
            found=f"an animation {format_settings['action']!r} already",
            allowed="a name that is free (--action)",
            remedy="--replace-action replaces it",
        )
