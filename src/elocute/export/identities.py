"""Writes identities of a head: a mesh for each face, or one contact sheet of all."""

from __future__ import annotations

import contextlib
from collections.abc import Callable, Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.errors import OutputError
from elocute.export.meshes import MESH_FORMATS
from elocute.export.pictures import COLUMNS, contact_sheet
from elocute.files.atomic import check_output, write_atomically, write_folder_atomically
from elocute.head.looks.dressing import dress, wearable
from elocute.head.looks.people import identity_look
from elocute.head.model import HeadModel
from elocute.render import Renderer, open_renderer, picture_size, portrait

SHEET_MAX = 200  # faces on one picture

Progress = Callable[[float], None] | None


def check_identity_output(path: str | Path, count: int, mesh: str = ".obj") -> None:
    """Refuse what `write_identities` could not write, before anything is computed.

    count: how many faces; mesh: suffix of the meshes in a folder, ".obj" or ".ply". Raises
    OutputError for a place, a suffix or a count that cannot be written.
    """
    path = check_output(path)
    suffix = path.suffix.lower()
    if mesh not in MESH_FORMATS:
        raise OutputError.about(f"format {mesh}", found="unknown", allowed=" ".join(MESH_FORMATS))
    if suffix not in ("", ".png", *MESH_FORMATS):
        raise OutputError.about(
            path,
            found=f"suffix {suffix!r}",
            allowed=".png for one picture; a new folder, perhaps ending in "
            + " or ".join(MESH_FORMATS),
        )
    if suffix == ".png" and count > SHEET_MAX:
        raise OutputError.about(path, found=f"{count} faces", allowed=f"up to {SHEET_MAX}")


def write_identities(
    head: HeadModel,
    identities: NDArray[np.float32],
    path: str | Path,
    *,
    first: int = 0,
    mesh: str = ".obj",
    size: tuple[int, int] = (800, 800),
    backend: str = "auto",
    progress: Progress = None,
) -> None:
    """Write identities of a head as meshes, or draw them all on one contact sheet.

    identities: (face, coefficient) float32, in standard deviations. path: a .png for one sheet,
    twice as wide as `size` in pixels; otherwise a new folder of 00000.obj, 00001.obj, … in metres,
    or of .ply by its own suffix or by `mesh`. first: number of the first face; on a sheet, faces of
    the built-in head's mesh are in the looks that go with their numbers as seeds.

    Raises OutputError for a place that cannot be written, and MachineError where no renderer works.
    """
    path = Path(path)
    check_identity_output(path, len(identities), mesh)
    suffix = path.suffix.lower()
    people = (head.with_identity(coefficients) for coefficients in identities)
    if suffix == ".png":
        side = max(32, 2 * picture_size(size)[0] // COLUMNS)
        numbers = range(first, first + len(identities))
        _write_sheet(head, people, numbers, path, side, backend, progress)
        return
    suffix = suffix or mesh
    with write_folder_atomically(path) as folder:
        for done, person in enumerate(people):
            # Faces that share all images share their files.
            tag = "" if person.surfaces == head.surfaces else f"{first + done:05d}_"
            writer = MESH_FORMATS[suffix](person, tag)
            writer.write_beside(folder)
            (folder / f"{first + done:05d}{suffix}").write_bytes(writer.mesh(person.template))
            if progress:
                progress((done + 1) / len(identities))


def _write_sheet(
    head: HeadModel,
    people: Iterable[HeadModel],
    numbers: Sequence[int],
    path: Path,
    side: int,
    backend: str,
    progress: Progress,
) -> None:
    pictures: list[NDArray[np.uint8]] = []
    with write_atomically(path) as draft, _renderers(head, side, backend) as renderer_of:
        for number, person in zip(numbers, people, strict=True):
            seen = _in_look(person, number)
            with renderer_of(seen) as renderer:
                pictures.append(renderer.frame(seen.template))
            if progress:
                progress(len(pictures) / len(numbers))
        contact_sheet(pictures, list(map(str, numbers)), min(COLUMNS, len(numbers))).save(draft)


def _in_look(person: HeadModel, seed: int) -> HeadModel:
    look = identity_look("auto", str(seed)) if wearable(person) else None
    return person if look is None else dress(person, look)


_RendererOf = Callable[[HeadModel], contextlib.AbstractContextManager[Renderer]]


@contextlib.contextmanager
def _renderers(head: HeadModel, side: int, backend: str) -> Iterator[_RendererOf]:
    """A renderer for each person: one for all where nobody has another colour of skin."""
    camera = portrait(head)

    def opened(person: HeadModel) -> Renderer:
        return open_renderer(person, (side, side), backend=backend, camera=camera)

    if len(head.tone_basis):
        yield opened
        return
    with opened(head) as shared:
        yield lambda person: contextlib.nullcontext(shared)
