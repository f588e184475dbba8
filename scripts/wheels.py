#!/usr/bin/env python3
"""Ask whether every dependency has wheels for the systems that are named to users.

    python scripts/wheels.py                what `pip install elocute` takes
    python scripts/wheels.py studio tts     and these extras

For each system and Python, pip resolves without installing or building anything. Prints a line for
each; exit code 1 where something is missing. PyTorch cannot be asked about from another system.
"""

from __future__ import annotations

import subprocess
import sys
import tempfile
import tomllib
from pathlib import Path

from packaging.requirements import Requirement

ROOT = Path(__file__).parents[1]
LINUX = ("manylinux_2_28", "manylinux_2_17", "manylinux2014", "manylinux_2_5", "manylinux1")
PLATFORMS = {
    "Windows": ("win_amd64",),
    "macOS, Apple": ("macosx_14_0_arm64",),
    "macOS, Intel": ("macosx_13_0_x86_64",),
    "Linux": tuple(f"{each}_x86_64" for each in LINUX),
    "Linux, ARM": tuple(f"{each}_aarch64" for each in LINUX),
}
PYTHONS = ("3.11", "3.13")


def main() -> int:
    """Resolve for all systems; 1 where one lacks a wheel."""
    project = tomllib.loads((ROOT / "pyproject.toml").read_text(encoding="utf-8"))["project"]
    wanted: list[str] = list(project["dependencies"])
    for extra in sys.argv[1:]:
        wanted += project["optional-dependencies"][extra]
    missing = 0
    for system, platforms in PLATFORMS.items():
        for python in PYTHONS:
            told = lacking(wanted_on(platforms[0], wanted), platforms, python)
            missing += bool(told)
            print(f"{system} ({platforms[0]}), Python {python}: {told or 'all there'}", flush=True)
    return int(missing > 0)


def wanted_on(platform: str, wanted: list[str]) -> list[str]:
    """What of it a machine needs; pip itself would ask markers about the one that it runs on."""
    machine = {"platform_machine": "aarch64" if platform.endswith("aarch64") else ""}
    needs = map(Requirement, wanted)
    return [
        f"{one.name}{one.specifier}"
        for one in needs
        if one.marker is None or one.marker.evaluate(machine)
    ]


def lacking(wanted: list[str], platforms: tuple[str, ...], python: str) -> str:
    """What pip says is missing; "" where it finds wheels of everything."""
    with tempfile.TemporaryDirectory() as room:
        done = subprocess.run(
            [
                *(sys.executable, "-m", "pip", "install", "--dry-run", "--quiet"),
                *("--ignore-installed", "--target", room, "--only-binary=:all:"),
                *("--implementation", "cp", "--python-version", python),
                *(word for each in platforms for word in ("--platform", each)),
                *wanted,
            ],
            capture_output=True,
            text=True,
        )
    faults = [line for line in done.stderr.splitlines() if line.startswith("ERROR: ")]
    return "" if done.returncode == 0 else (faults[0] if faults else done.stderr[-200:])


if __name__ == "__main__":
    sys.exit(main())
