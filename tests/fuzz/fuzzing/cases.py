"""What a reader is, and which bytes the case of a number has."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, field
from fnmatch import fnmatch
from pathlib import Path
from random import Random

from tests.fuzz.fuzzing.mutations import mutate

Files = dict[str, bytes]
"""Paths relative to a folder, with / between, to what the files hold."""


@dataclass(frozen=True)
class Reader:
    """One way that bytes of a user come in.

    name     of the reader, for reports and for the names of its cases
    seeds    writes small valid inputs into a folder, each in a folder of its own
    read     reads what lies in the first folder; what it writes goes into the second
    kinds    file name patterns to the kind of their mutations; other files stay as they are
    modules  imported before the first case, so that cases are fast
    repair   makes right again what a mutation would else be refused for at once: checksums
    needs    modules without which the reader is left out
    short    cases in the test suite
    """

    name: str
    seeds: Callable[[Path], None]
    read: Callable[[Path, Path], object]
    kinds: dict[str, str]
    modules: tuple[str, ...] = ()
    repair: Callable[[Files], None] | None = None
    needs: tuple[str, ...] = ()
    short: int = 300


@dataclass(frozen=True)
class Seed:
    """A valid input: its name, its files, and those among them that are mutated."""

    name: str
    files: Files = field(repr=False)
    kinds: dict[str, str]


def load_seeds(reader: Reader, folder: Path) -> list[Seed]:
    """Seeds that `reader.seeds` wrote, in the order of their names."""
    seeds = []
    for place in sorted(path for path in folder.iterdir() if path.is_dir()):
        files = {
            path.relative_to(place).as_posix(): path.read_bytes()
            for path in sorted(place.rglob("*"))
            if path.is_file()
        }
        kinds = {name: kind for name in files if (kind := _kind(reader, name))}
        seeds.append(Seed(place.name, files, kinds))
    if not seeds or not all(seed.kinds for seed in seeds):
        raise ValueError(f"{reader.name}: a seed without a file that is mutated")
    return seeds


def _kind(reader: Reader, name: str) -> str:
    return next((kind for pattern, kind in reader.kinds.items() if fnmatch(name, pattern)), "")


def case(reader: Reader, seeds: list[Seed], number: int) -> tuple[int, Files]:
    """Which seed the case of that number starts from, and the files that differ from it.

    The same number gives the same bytes wherever it is asked for. Small seeds, which are read
    fast, come more often than large ones.
    """
    rng = Random(f"{reader.name} {number}")
    sizes = [sum(map(len, seed.files.values())) for seed in seeds]
    place = rng.choices(range(len(seeds)), [1 / (1000 + size) ** 0.5 for size in sizes])[0]
    seed = seeds[place]
    names = list(seed.kinds)
    changed: Files = {}
    for name in rng.sample(names, min(len(names), rng.choice((1, 1, 1, 1, 2)))):
        kind = seed.kinds[name]
        others = tuple(
            data
            for each in seeds
            for path, data in each.files.items()
            if each.kinds.get(path) == kind
        )
        changed[name] = mutate(rng, seed.files[name], kind, others)
    if reader.repair is not None:
        whole = seed.files | changed
        reader.repair(whole)
        changed = {name: data for name, data in whole.items() if seed.files.get(name) != data}
    return place, changed
