"""One plan of all that a run writes, checked before anything is written.

Side files count as outputs too (the .wav beside a .glb). Refused are two outputs at one place, an
output that is an input, and whatever exists already, unless this tool made it from the very same
input and nobody changed it since (`files.ledger`), or the user said what is to be done with it.
"""

from __future__ import annotations

import contextlib
import os
import stat
import tempfile
import unicodedata
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from pathlib import Path

from elocute.errors import InputError, OutputError
from elocute.files.atomic import check_output, moved_aside
from elocute.files.ledger import Source, fingerprint, recall, remember, source_text

REMEDY = "`overwrite` replaces it, `no_clobber` keeps it"


@dataclass(frozen=True)
class Planned:
    """One file or folder to be written.

    sources  what it is made from: files, or texts that name something else
    beside   the output that it is a side file of, or None
    """

    path: Path
    sources: tuple[Source, ...]
    beside: Path | None = None

    @property
    def origin(self) -> str:
        """Its inputs as a person reads them."""
        return " and ".join(map(str, self.sources)) or "anything"


class OutputPlan:
    """What a run reads and will write: `add` everything, `check` once, then write."""

    def __init__(self, inputs: Iterable[Source] = (), *, remedy: str = REMEDY) -> None:
        self._inputs, self._planned = list(inputs), list[Planned]()
        self._remedy, self._folders = remedy, set[Path]()
        self._seen: dict[Path, str | None] = {}
        self.kept: list[Path] = []
        """Files that are there and stay as they are, since the user said so."""

    def add(self, path: Path, *sources: Source, beside: Path | None = None) -> None:
        """Plan an output made from `sources`, which count as inputs of the run."""
        self._planned.append(Planned(path, sources, beside))
        self._inputs += sources

    def make_folder(self, folder: Path) -> None:
        """Plan a folder, with those above it, that is made when a file in it is written."""
        self._folders.add(folder)

    def check(self, *, overwrite: bool = False, no_clobber: bool = False) -> OutputPlan:
        """Raise OutputError for the first output that would lose something; gives the plan.

        overwrite   files that exist are replaced; folders only where this tool made them
        no_clobber  outputs that exist are left out and listed in `kept`
        """
        if overwrite and no_clobber:
            raise InputError.about("`overwrite`", found="`no_clobber` too", allowed="one of them")
        for planned in self._planned:
            check_output(self._room(planned.path))
            self._seen[planned.path] = fingerprint(planned.path)
        _refuse_collisions(self._planned)
        inputs = _by_identity(self._inputs)
        for planned in self._planned:
            _refuse_inputs(planned, inputs)
            if self._seen[planned.path] is None:
                continue
            if no_clobber:
                self.kept.append(planned.path)
            else:
                _refuse_strangers(planned, overwrite, self._remedy)
        return self

    def _room(self, path: Path) -> Path:
        """Itself, or the outermost folder that is to be made for it."""
        if path.parent in self._folders:
            while not path.parent.exists():
                path = path.parent
        return path

    def wants(self, path: Path) -> bool:
        """Whether this output is to be written."""
        return path not in self.kept

    def wanted(self, paths: Iterable[Path]) -> list[Path]:
        return [path for path in paths if self.wants(path)]

    @property
    def finished(self) -> bool:
        """Whether there is nothing to be written at all."""
        return not any(self.wants(one.path) for one in self._planned if one.beside is None)

    @contextlib.contextmanager
    def writing(self, path: Path) -> Iterator[None]:
        """Around the writing of an output and of its side files; remembers them as made.

        Raises OutputError where something came there since `check`.
        """
        written = [one for one in self._planned if path in (one.path, one.beside)]
        written = [one for one in written if self.wants(one.path)]
        for one in written:
            if fingerprint(one.path) != self._seen[one.path]:
                raise OutputError.about(
                    one.path,
                    found="it was written by something else in the meantime",
                    remedy="choose another name",
                )
        with contextlib.ExitStack() as aside:
            if path.parent in self._folders:
                aside.enter_context(_made_folder(path.parent))
            for one in written:
                if one.path.is_dir() and not one.path.is_symlink():
                    aside.enter_context(moved_aside(one.path))
            yield
        for one in written:
            remember(one.path, one.sources)
            self._seen[one.path] = fingerprint(one.path)


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


def _refuse_strangers(planned: Planned, overwrite: bool, remedy: str) -> None:
    """Raise OutputError where what exists is not ours to replace."""
    path = planned.path
    known = recall(path)
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


def _refuse_collisions(planned: list[Planned]) -> None:
    """Two outputs at one place, also where the file system does not tell names apart by case."""
    first: dict[tuple[str, str], Planned] = {}
    alike: dict[tuple[str, str], Planned] = {}
    for one in planned:
        folder, name = os.path.realpath(one.path.parent), one.path.name
        other = first.setdefault((folder, name), one)
        if other is not one and other != one:
            raise _collision(one, other)
        plain = unicodedata.normalize("NFC", unicodedata.normalize("NFC", name).casefold())
        other = alike.setdefault((folder, plain), one)
        if other.path.name != name and _are_one_name(Path(folder), other.path.name, name):
            raise _collision(one, other)


def _collision(one: Planned, other: Planned) -> OutputError:
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
    """Whether the file system takes both for the same name: it is asked."""
    while not folder.is_dir():  # it may be one that is yet to be made
        folder = folder.parent
    with tempfile.TemporaryDirectory(prefix=".elocute-", dir=folder) as room:
        Path(room, name).touch()
        return Path(room, other).exists()


def _by_identity(inputs: Iterable[Source]) -> dict[tuple[int, int], Source]:
    """Inputs that exist, by what makes a file itself whatever it is called."""
    found: dict[tuple[int, int], Source] = {}
    for source in inputs:
        try:
            facts = Path(source).stat()
        except (OSError, ValueError):
            continue
        found.setdefault((facts.st_dev, facts.st_ino), source)
    return found


def _refuse_inputs(planned: Planned, inputs: dict[tuple[int, int], Source]) -> None:
    try:
        facts = planned.path.stat()
    except OSError:
        return
    source = inputs.get((facts.st_dev, facts.st_ino))
    found = None if source is None else f"an input of this run ({source})"
    if found is None and stat.S_ISDIR(facts.st_mode):
        place = os.path.realpath(planned.path)
        within = [s for s in inputs.values() if Path(os.path.realpath(s)).is_relative_to(place)]
        found = f"a folder that holds an input of this run ({within[0]})" if within else None
    if found is None and stat.S_ISREG(facts.st_mode) and not (recall(planned.path) or ("", 0))[1]:
        place = os.path.realpath(planned.path.parent)
        folders = [s for s in inputs.values() if Path(s).is_dir()]
        within = [s for s in folders if Path(place).is_relative_to(os.path.realpath(s))]
        found = f"a file of an input of this run ({within[0]})" if within else None
    if found is not None:
        aside = "" if planned.beside is None else f", where the sound of {planned.beside.name} goes"
        raise OutputError.about(
            planned.path, found=found + aside, remedy="choose another output name"
        )
