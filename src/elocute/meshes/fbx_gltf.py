"""FBX files as glTF, by Blender's Python module where that is installed."""

from __future__ import annotations

import importlib.util
import subprocess
import sys
import tempfile
from functools import lru_cache
from pathlib import Path

from elocute.errors import InputError, MachineError
from elocute.files.reading import FileKind, read_bytes
from elocute.meshes import fbx_child
from elocute.meshes.fbx_strings import without_places

FILE_MAX_BYTES = 400_000_000
TIME_MAX_S = 600.0
KEPT = 2
ALLOWED = "a sound binary .fbx of up to 400 MB"


def read_fbx(path: str | Path, *, error: type[InputError] = InputError) -> bytes:
    """Read an FBX file as a .glb with everything inside.

    Pictures are those that the file holds; what it only names is not looked for.

    Parameters
    ----------
    path : str or Path
        A binary .fbx.
    error : type of InputError
        The class to raise.

    Returns
    -------
    bytes

    Raises
    ------
    InputError
        Of the class `error`, for a file that is missing, too large, damaged or no binary FBX.
    MachineError
        Where Blender's module `bpy` is not installed.
    """
    data = read_bytes(path, FileKind(ALLOWED, FILE_MAX_BYTES, error))
    try:
        sound = without_places(data)
    except ValueError as problem:
        raise error.about(
            path,
            found=f"no FBX that can be read ({problem})",
            allowed=ALLOWED,
            remedy="export it anew, as binary FBX or better as .glb",
        ) from problem
    if importlib.util.find_spec("bpy") is None:
        raise MachineError(
            f"{path}: FBX is read by Blender's Python module; install it (pip install bpy), or "
            "export the file from Blender as .glb"
        )
    try:
        return _converted(sound)
    except ValueError as problem:
        raise error.about(
            path, found="an FBX that Blender cannot read", allowed=ALLOWED
        ) from problem


@lru_cache(maxsize=KEPT)
def _converted(data: bytes) -> bytes:
    """What Blender makes of the file. Raises ValueError where it makes nothing."""
    with tempfile.TemporaryDirectory() as folder:
        source, target = Path(folder) / "head.fbx", Path(folder) / "head.glb"
        source.write_bytes(data)
        try:
            subprocess.run(
                [sys.executable, "-I", fbx_child.__file__, str(source), str(target)],
                stdin=subprocess.DEVNULL,
                stdout=subprocess.DEVNULL,
                stderr=subprocess.DEVNULL,
                cwd=folder,
                timeout=TIME_MAX_S,
                check=True,
            )
            return target.read_bytes()
        except (subprocess.SubprocessError, OSError) as problem:
            raise ValueError("nothing was written") from problem
