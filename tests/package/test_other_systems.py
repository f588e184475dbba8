"""What Windows and macOS lack is not needed: simulated here by taking it away.

Each program runs in a Python of its own, in which Elocute's modules cannot import what only POSIX
has, and in which `os` lacks what it lacks on Windows.
"""

from __future__ import annotations

from pathlib import Path

import pytest

import elocute
from tests.support.commands import SAME_ELOCUTE, run_python

TAKE_AWAY = """
import builtins, os, shutil, signal, sys, tempfile
POSIX_ONLY = {"fcntl", "grp", "posix", "pty", "pwd", "resource", "termios", "tty"}
real = builtins.__import__
def lacking(name, globals=None, *rest, **more):
    importer = (globals or {}).get("__name__", "")
    if name.split(".")[0] in POSIX_ONLY and importer.split(".")[0] in ("elocute", "__main__"):
        raise ModuleNotFoundError(f"No module named {name!r}", name=name)
    return real(name, globals, *rest, **more)
builtins.__import__ = lacking
shutil._use_fd_functions = False
for name in ("fork", "forkpty", "getegid", "geteuid", "getgid", "getpgid", "getuid", "killpg",
             "mkfifo", "O_DIRECTORY", "O_NOFOLLOW", "O_NONBLOCK", "setsid", "statvfs"):
    if hasattr(os, name):
        delattr(os, name)
for name in ("SIGALRM", "SIGHUP", "SIGKILL", "SIGPIPE", "SIGQUIT"):
    if hasattr(signal, name):
        delattr(signal, name)
"""
EVERY_MODULE = """
import importlib, pkgutil, elocute
from elocute.errors import MachineError
seen = 0
for module in pkgutil.walk_packages(elocute.__path__, "elocute."):
    if module.name == "elocute.__main__":
        continue
    try:
        importlib.import_module(module.name)
    except (ModuleNotFoundError, MachineError) as error:
        missing = error if isinstance(error, ModuleNotFoundError) else error.__cause__
        assert missing.name.split(".")[0] in EXTRAS, f"{module.name}: {error}"
    seen += 1
print(seen)
"""
EXTRAS = {
    "bpy",
    "DracoPy",
    "espeakng_loader",
    "fastapi",
    "faster_whisper",
    "google",
    "grpc",
    "h11",
    "lightning_fabric",
    "livekit",
    "matplotlib",
    "mediapipe",
    "meshopt",
    "numba",
    "nvidia_ace",
    "nvidia_audio2face_3d",
    "onnx",
    "pandas",
    "pipecat",
    "pocketsphinx",
    "pyarrow",
    "ray",
    "safetensors",
    "scipy",
    "sounddevice",
    "sqlalchemy",
    "starlette",
    "statsmodels",
    "tensorboard",
    "torch",
    "transformers",
    "uvicorn",
    "websockets",
}


def run(program: str, *arguments: object) -> str:
    result = run_python("-c", TAKE_AWAY + program, *arguments, env=SAME_ELOCUTE)
    assert result.returncode == 0, result.stderr
    return result.stdout


def test_every_module_is_imported_without_posix():
    assert int(run(f"EXTRAS = {EXTRAS!r}\n{EVERY_MODULE}")) > 150


def test_the_simulation_takes_something_away():
    with pytest.raises(AssertionError, match="No module named 'fcntl'"):
        run("import fcntl")


@pytest.mark.slow
@pytest.mark.parametrize("suffix", ["npz", "csv", "glb", "html"])
def test_speech_is_animated_without_posix(tmp_path, speech_wav, suffix):
    run(
        "from elocute.cli import main; main()",
        "animate",
        speech_wav,
        "-o",
        tmp_path / f"talk.{suffix}",
    )
    assert (tmp_path / f"talk.{suffix}").stat().st_size > 10_000


NO_PICTURES = """
import builtins
real_import = builtins.__import__
def without(name, *rest, **more):
    if name.split(".")[0] in ("moderngl", "embreex"):
        raise ModuleNotFoundError(f"No module named {name!r}", name=name)
    return real_import(name, *rest, **more)
builtins.__import__ = without
from elocute.cli import main
main()
"""
"""Linux on ARM has neither: pyproject.toml leaves them out there."""


def test_all_but_pictures_works_without_the_packages_that_draw(tmp_path, speech_wav):
    import soundfile

    samples, rate = soundfile.read(speech_wav, stop=16000)
    soundfile.write(tmp_path / "a.wav", samples, rate)
    words = "animate", tmp_path / "a.wav", "--fps", 10
    outputs = [tmp_path / f"talk.{suffix}" for suffix in ("npz", "csv", "glb", "html")]
    done = run_python("-c", NO_PICTURES, *words, *(w for o in outputs for w in ("-o", o)))
    assert done.returncode == 0, done.stderr
    assert all(path.stat().st_size > 500 for path in outputs)
    drawn = run_python("-c", NO_PICTURES, *words, "-o", tmp_path / "talk.mp4")
    assert drawn.returncode == 1 and "no renderer works here" in drawn.stderr.splitlines()[-1]
    assert not (tmp_path / "talk.mp4").exists()


def test_the_package_holds_no_scripts_of_a_shell():
    package = Path(elocute.__file__).parent
    files = [path for path in package.rglob("*") if path.is_file()]
    assert not [path for path in files if path.read_bytes().startswith(b"#!")]
    assert not [path for path in files if path.suffix in (".sh", ".bash")]


def test_file_names_are_allowed_on_every_system():
    """Windows reserves some names and characters, and takes capitals for the same letters."""
    package = Path(elocute.__file__).parent
    names = [path.relative_to(package).as_posix() for path in package.rglob("*")]
    reserved = {"con", "prn", "aux", "nul", *(f"{x}{i}" for x in ("com", "lpt") for i in range(10))}
    parts = {part for name in names for part in name.split("/")}
    assert not [
        p for p in parts if p.split(".")[0].lower() in reserved or set(p) & set('<>:"|?*\\')
    ]
    assert len({name.lower() for name in names}) == len(names)
