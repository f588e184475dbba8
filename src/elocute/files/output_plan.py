"""One plan of all that a run writes, checked before anything is written.

Side files count as outputs too (the .wav beside a .glb). Refused are two outputs at one place, an
output that is an input, and whatever exists already, unless this tool made it from the very same
input and nobody changed it since (`output_history`), or the user says what to do with it.
"""

from __future__ import annotations

import contextlib
import os
import stat
import tempfile
import unicodedata
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import partial
from pathlib import Path

from elocute.errors import InputError, OutputError
from elocute.files.atomic import (
    announced,
    check_output,
    moved_aside,
    unchanged,
    written_meanwhile,
)
from elocute.files.output_history import (
    Source,
    fingerprint,
    recall_output,
    remember_output,
    source_text,
)

STANDARD_INPUT = "-"
REMEDY = "`overwrite` replaces it, `no_clobber` keeps it"


@dataclass(frozen=True)
class PlannedOutput:
    """One file or folder to be written."""

    path: Path  # the output
    sources: tuple[Source, ...]  # what it is made from: files, or texts that name something else
    beside: Path | None = None  # the output that it is a side file of
    grown: bool = False  # whether something is added to a file that may be there

    @property
    def origin(self) -> str:
        """Its sources, as a message names them."""
        return " and ".join(map(str, self.sources)) or "anything"


class OutputPlan:
    """What a run reads and will write: `add` everything, `check` once, then write.

    Parameters
    ----------
    inputs : iterable of str or Path
        What the run reads.
    remedy : str
        What to do about a file that exists; appears in the message.

    Attributes
    ----------
    kept : list of Path
        Outputs that exist and stay as they are, since the user said so.
    """

    def __init__(self, inputs: Iterable[Source] = (), *, remedy: str = REMEDY) -> None:
        self._inputs, self._planned = list(inputs), list[PlannedOutput]()
        self._remedy, self._folders = remedy, set[Path]()
        self._seen: dict[Path, str | None] = {}
        self.kept: list[Path] = []
        """Files that are there and stay as they are, since the user said so."""

    def add(
        self, path: Path, *sources: Source, beside: Path | None = None, grown: bool = False
    ) -> None:
        """Plan an output that is made from sources, which count as inputs of the run.

        A side file is `beside` another output. One that is `grown` is a file to which the run adds:
        it may be there, and several outputs may go into it.
        """
        self._planned.append(PlannedOutput(path, sources, beside, grown))
        self._inputs += sources

    def make_folder(self, folder: Path) -> None:
        """Plan a folder, with those above it, that is made when a file in it is written."""
        self._folders.add(folder)

    def check(self, *, overwrite: bool = False, no_clobber: bool = False) -> OutputPlan:
        """Check that no output would destroy something, and return the plan.

        `overwrite` replaces files that exist, and folders that this tool made; `no_clobber` leaves
        out outputs that exist, and lists them in `kept`. Raises OutputError for the first output
        that cannot be written, or would destroy something, InputError for both together.
        """
        if overwrite and no_clobber:
            raise InputError.about("`overwrite`", found="`no_clobber` too", allowed="one of them")
        for planned in self._planned:
            _check_working_folder(planned.path)
            check_output(self._room(planned.path))
            _refuse_linked_folder(planned.path)
            self._seen[planned.path] = fingerprint(planned.path)
        _refuse_collisions(self._planned)
        inputs = _by_identity(self._inputs)
        for planned in self._planned:
            _refuse_inputs(planned, inputs)
            if self._seen[planned.path] is None or planned.grown:
                continue
            if no_clobber:
                self.kept.append(planned.path)
            else:
                _refuse_strangers(planned, overwrite, self._remedy)
        return self

    def _room(self, path: Path) -> Path:
        """The path itself, or the outermost folder that is to be made for it."""
        if path.parent in self._folders:
            while not path.parent.exists():
                path = path.parent
        return path

    def wants(self, path: Path) -> bool:
        """Whether a planned output is to be written; False where it is kept."""
        return path not in self.kept

    def wanted(self, paths: Iterable[Path]) -> list[Path]:
        """Those of some planned outputs that are to be written, in the same order."""
        return [path for path in paths if self.wants(path)]

    @property
    def finished(self) -> bool:
        """Whether nothing is to be written at all."""
        return not any(self.wants(one.path) for one in self._planned if one.beside is None)

    @contextlib.contextmanager
    def writing(self, path: Path) -> Iterator[None]:
        """Write a planned output and its side files in this block; they are remembered as made.

        Raises OutputError where something else was written there since `check`, or a folder cannot
        be made.
        """
        written = [one for one in self._planned if path in (one.path, one.beside)]
        written = [one for one in written if self.wants(one.path)]
        for one in written:
            if fingerprint(one.path) != self._seen[one.path]:
                raise written_meanwhile(one.path)
        with contextlib.ExitStack() as aside:
            if path.parent in self._folders:
                aside.enter_context(_made_folder(path.parent))
            for one in written:
                aside.enter_context(announced(one.path, partial(_note, one)))
                if one.path.is_dir() and not one.path.is_symlink():
                    aside.enter_context(moved_aside(one.path))
                else:
                    aside.enter_context(unchanged(one.path))
            yield
        for one in written:
            remember_output(one.path, one.sources)
            self._seen[one.path] = fingerprint(one.path)


def _note(planned: PlannedOutput, draft: Path) -> None:
    """Note what an output will be when its draft has taken its place."""
    remember_output(planned.path, planned.sources, draft)


def _check_working_folder(path: Path) -> None:
    """Raise OutputError for a relative path where the working folder was deleted."""
    if path.is_absolute():
        return
    try:
        Path.cwd()
    except OSError as error:
        raise OutputError.about(
            path, found="the current folder does not exist any more", remedy="cd to another one"
        ) from error


def _refuse_linked_folder(path: Path) -> None:
    if path.is_symlink() and path.is_dir():
        raise OutputError.about(path, found="a link to a folder", allowed="a file name")


@contextlib.contextmanager
def _made_folder(folder: Path) -> Iterator[None]:
    """A folder with those above it; where the block fails, those that are new and empty go."""
    new = []
    for place in (folder, *folder.parents):
        if os.path.lexists(place):
            break
        new.append(place)
    try:
        try:
            folder.mkdir(parents=True, exist_ok=True)
        except OSError as error:
            raise OutputError.about(folder, found=f"cannot be made ({error.strerror})") from error
        yield
    except BaseException:
        for place in new:
            with contextlib.suppress(OSError):
                place.rmdir()
        raise


def _refuse_strangers(planned: PlannedOutput, overwrite: bool, remedy: str) -> None:
    """Raise OutputError for what exists and is not ours to replace."""
    path = planned.path
    known = recall_output(path)
    if known is not None and known[1] and (overwrite or known[0] == source_text(planned.sources)):
        return
    is_folder = path.is_dir() and not path.is_symlink()
    if overwrite and not is_folder:
        return
    what = "exists already: " + ("a folder" if is_folder else "a file")
    if planned.beside is not None:
        what = f"{what} where the sound beside {planned.beside.name} belongs,"
    if known is None:
        found = f"{what} that was not made from {planned.origin}"
    elif not known[1]:
        found = f"{what} that was changed since it was made"
    else:
        found = f"{what} made from {' and '.join(known[0].splitlines())}, not {planned.origin}"
    if is_folder:
        remedy = "remove it or choose another name"
    raise OutputError.about(path, found=found, remedy=remedy)


def _refuse_collisions(planned: list[PlannedOutput]) -> None:
    """Raise OutputError for two outputs at one place, also where names differ only by case."""
    first: dict[tuple[str, str], PlannedOutput] = {}
    alike: dict[tuple[str, str], PlannedOutput] = {}
    for one in planned:
        folder, name = os.path.realpath(one.path.parent), one.path.name
        other = first.setdefault((folder, name), one)
        if other is not one and other != one and not (one.grown and other.grown):
            raise _collision(one, other)
        plain = unicodedata.normalize("NFC", unicodedata.normalize("NFC", name).casefold())
        other = alike.setdefault((folder, plain), one)
        if other.path.name != name and _are_one_name(Path(folder), other.path.name, name):
            raise _collision(one, other)


def _collision(one: PlannedOutput, other: PlannedOutput) -> OutputError:
    """The error for two outputs at one place."""
    if one.sources == other.sources:
        return OutputError.about(
            one.path, found=f"two outputs of {one.origin} at one place", remedy="rename one"
        )
    return OutputError.about(
        one.path,
        found=f"the output of both {other.origin} and {one.origin}",
        allowed="one input for each output",
        remedy="rename one, or write them to two folders",
    )


def _are_one_name(folder: Path, name: str, other: str) -> bool:
    """Whether the file system takes both for the same name, found out by asking it."""
    while not folder.is_dir():  # it may be one that is yet to be made
        folder = folder.parent
    with tempfile.TemporaryDirectory(prefix=".elocute-", dir=folder) as room:
        Path(room, name).touch()
        return Path(room, other).exists()


def _by_identity(inputs: Iterable[Source]) -> dict[tuple[int, int], Source]:
    """Inputs that exist, by device and inode: what makes a file itself whatever it is called."""
    by_identity: dict[tuple[int, int], Source] = {}
    for source in inputs:
        try:
            facts = os.fstat(0) if str(source) == STANDARD_INPUT else Path(source).stat()
        except (OSError, ValueError):
            continue
        by_identity.setdefault((facts.st_dev, facts.st_ino), source)
    return by_identity


def _refuse_inputs(planned: PlannedOutput, inputs: dict[tuple[int, int], Source]) -> None:
    """Raise OutputError for an output that would destroy an input."""
    lost = _input_at(planned.path, inputs)
    if lost is not None:
        aside = "" if planned.beside is None else f", where the sound of {planned.beside.name} goes"
        raise OutputError.about(
            planned.path, found=lost + aside, remedy="choose another output name"
        )


def _input_at(path: Path, inputs: dict[tuple[int, int], Source]) -> str | None:
    """What input would be lost where an output is written to `path`, or None."""
    try:
        facts = path.stat()
    except OSError:
        return None
    source = inputs.get((facts.st_dev, facts.st_ino))
    if source is not None:
        return f"an input of this run ({source})"
    if stat.S_ISDIR(facts.st_mode):
        place = os.path.realpath(path)
        within = [s for s in inputs.values() if Path(os.path.realpath(s)).is_relative_to(place)]
        return f"a folder that holds an input of this run ({within[0]})" if within else None
    if stat.S_ISREG(facts.st_mode) and not (recall_output(path) or ("", False))[1]:
        place = os.path.realpath(path.parent)
        folders = [s for s in inputs.values() if Path(s).is_dir()]
        within = [s for s in folders if Path(place).is_relative_to(os.path.realpath(s))]
        return f"a file of an input of this run ({within[0]})" if within else None
    return None
