"""Outputs of texts that are spoken: what they are made from, and the takes of a table."""

from __future__ import annotations

import hashlib
import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

from elocute.cli.format_options import INTO, FormatSettings, settings_for_format
from elocute.cli.one_file import has_take
from elocute.cli.outputs import write_motion
from elocute.cli.pipes import PIPE
from elocute.cli.takes import named_inputs
from elocute.errors import InputError
from elocute.files.output_plan import OutputPlan
from elocute.files.reading import read_bytes
from elocute.speech.voices.settings import VoiceSettings

if TYPE_CHECKING:
    from elocute.animation import Animation
    from elocute.cli.line_table import Line, UnusableLine
    from elocute.jobs.pool import Pool


def spoken_source(text: str, voice: VoiceSettings, settings: Mapping[str, Any]) -> str:
    """What an output of a spoken text or a row is made from: the same line for the same take."""
    record = json.dumps([" ".join(text.split()), asdict(voice), settings], default=str)
    recording = settings.get("recording")
    what = f"the recording {recording[0][:40]!r}" if recording else f"the text {text[:40]!r}"
    return f"{what} ({hashlib.sha256(record.encode()).hexdigest()[:12]})"


def plan_take(
    plan: OutputPlan,
    target: Path,
    *sources: str | Path,
    sound: Path | None,
    format_settings: FormatSettings,
) -> None:
    """Plan an output, and the sound beside it where it has one. Raises InputError.

    sound: the recording, None where a text is spoken.
    """
    from elocute.export.registry import check_suffix, side_files

    check_suffix(target)
    chosen = settings_for_format(target, format_settings)
    plan.add(target, *sources, grown=chosen.get("add", False))
    for side in side_files(target, sound or PIPE, chosen):
        plan.add(side, *sources, beside=target)


@dataclass(frozen=True)
class TableRun:
    """What all takes of a table share."""

    folder: Path
    table: Path | None
    formats: tuple[str, ...]
    settings: Mapping[str, Any]
    format_settings: FormatSettings
    overwrite: bool
    no_clobber: bool
    into: Path | None = None  # the file that takes are added to, but where a line names another

    def file_of(self, name: str, cell: str, allowed: str) -> Path | None:
        """A file that a cell names, below the table's folder; None for an empty cell."""
        folder = Path() if self.table is None else self.table.parent
        return _file_below(folder, name, cell, allowed)

    def sound_of(self, line: Line) -> Path | None:
        """The recording of a line, None where its text is spoken. Raises InputError."""
        return self.file_of(line.audio, "audio", "a sound file")

    def targets(self, line: Line) -> list[Path]:
        into = self.into_of(line)
        files = [self.folder / f"{line.name}.{kind.lstrip('.')}" for kind in self.formats]
        return files + ([] if into is None else [into])

    def into_of(self, line: Line) -> Path | None:
        """The file that a line's take is added to; None for none."""
        return self.folder / line.into if line.into else self.into

    def formats_of(self, line: Line) -> FormatSettings:
        """Options of the formats of a line's outputs."""
        into, action = self.into_of(line), line.action
        chosen = dict(self.format_settings)
        if into is not None:
            chosen |= {INTO: into, "action": action or line.name}
        return chosen | ({"action": action} if action else {})

    def settings_of(self, line: Line) -> dict[str, Any]:
        """Those of the command, but for what the line says."""
        edits = self.file_of(line.settings.get("edits", ""), "edits", "an edit list")
        own = line.settings if edits is None else {**line.settings, "edits": edits}
        return {**self.settings, **own}


class FolderRun(TableRun):
    """What all recordings of folders share: a line names its file itself."""

    def sound_of(self, line: Line) -> Path | None:
        """The recording."""
        return Path(line.audio)


def check_one_worker(run: TableRun, lines: Sequence[Line | UnusableLine], pool: Pool) -> None:
    """Raise InputError where several workers would add to one file."""
    from elocute.cli.line_table import Line
    from elocute.jobs.pool import one_after_another

    into = [run.into_of(line) for line in lines if isinstance(line, Line)]
    if any(into) and pool is not one_after_another:
        raise InputError.about(
            "--jobs",
            found=f"takes that are added to {next(each for each in into if each)}",
            allowed="one worker for these",
            remedy="leave --jobs and --ray out",
        )


def make_take(task: tuple[Line, TableRun]) -> dict[str, Any]:
    """Make the take of one line: what was written, what was there already.

    What this very line made before, and nobody changed, is not made again. Raises InputError.
    """
    line, run = task
    settings = run.settings_of(line)
    sound = run.sound_of(line)
    formats = run.formats_of(line)
    if sound is None and INTO in formats:
        raise InputError.about(
            "into",
            found="a text that is spoken, whose sound has no place there",
            allowed="a line with a recording",
        )
    made_from = {**settings, **formats}
    if settings["edits"] is not None:
        from elocute.motion.edits.edit_list import EDITS_FILE

        data = read_bytes(settings["edits"], EDITS_FILE)
        made_from["edits"] = hashlib.sha256(data).hexdigest()
    if sound is not None:
        facts = sound.stat()
        made_from["recording"] = [line.audio, facts.st_size, facts.st_mtime_ns]
    source = spoken_source(line.text, line.voice, made_from)
    inputs = [
        *([run.table] if run.table else []),
        *named_inputs(settings),
        *([sound] if sound else []),
    ]
    plan, done = OutputPlan(inputs), []
    for target in run.targets(line):
        if target == formats.get(INTO):
            made = has_take(target, formats)
        else:
            made = _is_made(target, source)
        if made:
            done.append(target)
        else:
            plan.make_folder(target.parent)
            plan_take(plan, target, source, sound=sound, format_settings=formats)
    plan.check(overwrite=run.overwrite, no_clobber=run.no_clobber)
    wanted = plan.wanted([target for target in run.targets(line) if target not in done])
    record: dict[str, Any] = {"id": line.name, "outputs": [str(target) for target in wanted]}
    kept = [str(target) for target in run.targets(line) if target not in wanted]
    if kept:
        record["kept"] = kept
    if not wanted:
        return record
    animation = _animated(line, sound, settings)
    for target in wanted:
        write_motion(
            plan,
            animation.motion,
            target,
            sound=animation.sound,
            words=animation.words,
            progress=None,
            format_settings=formats,
        )
    record["duration_s"] = round(animation.motion.duration_s, 4)
    if animation.notes:
        record["notes"] = list(animation.notes)
    return record


def _animated(line: Line, sound: Path | None, settings: dict[str, Any]) -> Animation:
    if sound is None:
        from elocute.speaking import say

        return say(line.text, **asdict(line.voice), **settings)
    from elocute.animation import animate

    if line.text:
        settings = {**settings, "transcribe": False}
    return animate(sound, text=line.text or None, language=line.voice.language, **settings)


def _is_made(target: Path, source: str) -> bool:
    """Whether an output was made from this source and is still as it was made."""
    from elocute.files.output_history import recall_output, source_text

    known = recall_output(target)
    return known is not None and known[1] and known[0] == source_text([source])


def _file_below(folder: Path, name: str, cell: str, allowed: str) -> Path | None:
    """A file below a folder; None for no name. Raises InputError for any other place."""
    if not name:
        return None
    from elocute.corpus.word_clip import is_inside

    path = folder / name
    inside = is_inside(name) and Path(os.path.realpath(path)).is_relative_to(
        os.path.realpath(folder)
    )
    if not inside or not path.is_file():
        raise InputError.about(
            cell,
            found=repr(name[:80]) + ("" if not inside else ", which is not there"),
            allowed=f"{allowed} below the folder of the table",
        )
    return path
