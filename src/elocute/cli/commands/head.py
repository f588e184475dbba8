"""`elocute head`: a head model described, and random faces of it."""

from __future__ import annotations

import json
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from elocute.cli import format_options, options
from elocute.cli.characters import tell_character
from elocute.cli.command_group import CommandGroup
from elocute.cli.outputs import nothing_to_do
from elocute.cli.progress import progress_bar
from elocute.errors import InputError, OutputError
from elocute.files.output_plan import OutputPlan
from elocute.meshes.gltf_document import SUFFIXES as CHARACTER_SUFFIXES

if TYPE_CHECKING:
    from elocute.head.model import HeadModel

OWN_FILE_SUFFIXES = (".glb", ".vrm")
app = CommandGroup("Describe head models, make them speak, and draw random faces of them.")


@app.command("show")
def show_command(
    file: str = typer.Argument(..., help="A FLAME model (.pkl), a head (.npz), or `builtin`."),
    as_json: bool = options.Json,
) -> None:
    """Describe a head model. No code in the file is run."""
    from elocute.head.registry import open_head

    record = {"file": file, **_facts(open_head(file))}
    if as_json:
        print(json.dumps(record))
        return
    for name, value in record.items():
        shown = ", ".join(map(str, value)) if isinstance(value, list) else value
        print(f"{name:13} {('yes' if shown else 'no') if isinstance(shown, bool) else shown}")


def _facts(head: HeadModel) -> dict[str, Any]:
    low, high = head.template.min(axis=0), head.template.max(axis=0)
    return {
        "name": head.name,
        "vertices": head.vertex_count,
        "faces": len(head.quads),
        "identities": len(head.identity_basis),
        "expressions": len(head.expression_names),
        "joints": list(head.joint_names),
        "landmarks": len(head.landmarks) > 0,
        "lips": len(head.inner_lip_upper) > 0,
        "size_mm": [round(1000 * side, 1) for side in (high - low).tolist()],
    }


@app.command("adopt")
def adopt_command(
    file: str = typer.Argument(
        ...,
        help="A character with shapes of its own (.glb, .gltf, .vrm, .fbx), a FLAME model (.pkl), "
        "a mesh of FLAME's vertices, or a scan or another mesh of a face at rest (.ply, .obj, "
        ".stl, .glb, .gltf, .vrm, .fbx).",
    ),
    output: Path = typer.Option(
        ...,
        "-o",
        "--output",
        help="The head to write (.npz); with `--keep-mesh` also .glb: the mesh's own glTF file "
        "with ARKit's 52 shapes in it.",
    ),
    mesh: str | None = options.Mesh,
    keep_mesh: bool = typer.Option(
        False,
        "--keep-mesh",
        help="The mesh speaks on its own vertices, with its materials: its lips have to be apart "
        "in the mesh. Otherwise the built-in head is laid over it.",
    ),
    landmarks: Path | None = options.Landmarks,
    unit: str | None = typer.Option(
        None, help="Unit of a mesh: m, mm, cm, dm or inch; by default the one that fits a head."
    ),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Make a head of a file ready to speak, once for all that is made with it.

    A character keeps its shapes: what moves them is told, and kept with the file in the head.
    Other heads are given the built-in head's shapes. A scan becomes the built-in head with the
    scan's face and colours; with `--keep-mesh` a mesh keeps its vertices and materials, and `-o
    hero.glb` puts ARKit's shapes into its own file. `--head` takes the file itself as well, and
    does this each time.
    """
    from elocute.adoption.registry import is_scan, open_speaking_head
    from elocute.head.store import save_head

    suffixes = (".npz", *(OWN_FILE_SUFFIXES if keep_mesh else ()))
    if output.suffix.lower() not in suffixes:
        raise OutputError.about(
            output, found=f"suffix {output.suffix!r}", allowed=" or ".join(suffixes)
        )
    plan = OutputPlan([landmarks] if landmarks else [])
    plan.add(output, file)
    if nothing_to_do(plan, overwrite, no_clobber, as_json):
        return
    if keep_mesh:
        _adopt_mesh(Path(file), landmarks, unit, output, plan, as_json)
        return
    if mesh is None and is_scan(Path(file)):
        _adopt_scan(Path(file), landmarks, unit, output, plan, as_json)
        return
    if landmarks is not None or unit is not None:
        flag = "--unit" if landmarks is None else "--landmarks"
        raise InputError.about(flag, found=f"with {file}", allowed="for a mesh without shapes")
    if Path(file).suffix.lower() in CHARACTER_SUFFIXES:
        _adopt_character(Path(file), mesh, output, plan, as_json)
        return
    head = open_speaking_head(file, mesh)
    with plan.writing(output):
        save_head(output, head)
    if as_json:
        print(json.dumps({"file": file, "output": str(output), **_facts(head)}))
    else:
        print(output)


def _adopt_scan(
    file: Path,
    landmarks: Path | None,
    unit: str | None,
    output: Path,
    plan: OutputPlan,
    as_json: bool,
) -> None:
    from elocute.cli.scans import need_scipy

    need_scipy()
    from elocute.capture.scanned_head import open_scanned_head
    from elocute.head.store import save_head

    scanned = open_scanned_head(file, landmarks, unit)
    with plan.writing(output):
        save_head(output, scanned.head)
    error = scanned.registration.surface
    if as_json:
        record = {"file": str(file), "output": str(output), "surface_mm": error.record()}
        print(json.dumps(record | {"landmark_mm": scanned.registration.landmark_mm}))
        return
    print(output)
    print(f"the face lies {error.face_median:.2f} mm off the scan (median)")
    if scanned.registration.landmark_mm is None:
        print("note: no landmarks, so features may lie some millimetres off: give --landmarks")


def _adopt_mesh(
    file: Path,
    landmarks: Path | None,
    unit: str | None,
    output: Path,
    plan: OutputPlan,
    as_json: bool,
) -> None:
    from elocute.cli.scans import need_scipy

    need_scipy()
    from elocute.adoption.mesh_without_shapes import adopt_mesh
    from elocute.adoption.shapes_in_file import with_arkit_shapes
    from elocute.files.atomic import write_atomically
    from elocute.head.store import save_head

    adopted = adopt_mesh(file, landmarks, unit)
    adoption = adopted.adoption
    if output.suffix.lower() in OWN_FILE_SUFFIXES:
        data = with_arkit_shapes(adopted, str(file))
        with plan.writing(output), write_atomically(output) as draft:
            draft.write_bytes(data)
    else:
        with plan.writing(output):
            save_head(output, adoption.head)
    if as_json:
        record = {"file": str(file), "output": str(output), **_facts(adoption.head)}
        print(json.dumps(record | {"rest_gap_mm": adoption.rest_gap_mm}))
        return
    print(output)
    print(f"lips stood {adoption.rest_gap_mm:.2f} mm apart at rest, and meet now")


def _adopt_character(
    file: Path, mesh: str | None, output: Path, plan: OutputPlan, as_json: bool
) -> None:
    from elocute.adoption.characters.open_character import character_head, open_character
    from elocute.head.store import save_head

    opened = open_character(file, mesh)
    with plan.writing(output):
        save_head(output, character_head(opened.character))
    tell_character(file, opened, as_json, output=str(output))
    if not as_json:
        print(output)


@app.command("sample")
def sample_command(
    output: Path = typer.Option(
        ..., "-o", "--output", help="A .png for one contact sheet, or a new folder for mesh files."
    ),
    count: int = typer.Option(10, help="Number of faces."),
    seed: int = typer.Option(
        0, help="The first face; faces are numbered by what `--identity` takes."
    ),
    head: str = typer.Option("builtin", help="A FLAME model (.pkl), a head (.npz), or `builtin`."),
    mesh: str = typer.Option(
        "obj", "--format", help="Format of the mesh files in a folder: obj or ply."
    ),
    size: str = format_options.Size,
    backend: str = format_options.Backend,
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Draw random faces of a head, as meshes or as one picture."""
    from elocute.export.identities import check_identity_output, write_identities
    from elocute.head.identity import seeded_identities
    from elocute.head.registry import open_head

    suffix, pixels = f".{mesh.lower().removeprefix('.')}", format_options.parse_size(size)
    plan = OutputPlan()
    plan.add(output, head)
    if nothing_to_do(plan, overwrite, no_clobber, as_json):
        return
    check_identity_output(output, count, suffix)
    model = open_head(head)
    identities = seeded_identities(seed, count, None if head == "builtin" else model)
    with plan.writing(output), progress_bar(f"drawing {output.name}", as_json) as progress:
        write_identities(
            model,
            identities,
            output,
            first=seed,
            mesh=suffix,
            size=pixels,
            backend=backend,
            progress=progress,
        )
    if as_json:
        record = {"output": str(output), "head": model.name, "count": count, "seed": seed}
        print(json.dumps(record))
    else:
        print(output)
