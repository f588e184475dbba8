"""`scripts/setup` never runs apt without saying so first, and its pins install everywhere."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from importlib.metadata import metadata
from pathlib import Path

import pytest
from packaging.specifiers import SpecifierSet

ROOT = Path(__file__).parents[2]
pytestmark = pytest.mark.skipif(os.name != "posix", reason="a script for Debian and its like")
PYTHON = """#!/bin/sh
if [ "$2" = venv ]; then mkdir -p .venv/bin; cp "$0" .venv/bin/python; fi
"""


def setup(folder: Path, user: int, **variables: str) -> tuple[str, list[str]]:
    """What it prints, and what apt-get was asked, where libEGL is missing; both are stand-ins."""
    (folder / "scripts").mkdir()
    shutil.copy(ROOT / "scripts/setup", folder / "scripts/setup")
    tools = folder / "bin"
    tools.mkdir()
    said = folder / "said"
    stand_ins = {
        "python": PYTHON,
        "apt-get": f'#!/bin/sh\necho "apt-get $*" >> {said}\n',
        "id": f"#!/bin/sh\necho {user}\n",
        "ldconfig": "#!/bin/sh\n",
    }
    for name, text in stand_ins.items():
        (tools / name).write_text(text)
        (tools / name).chmod(0o755)
    environment = {name: text for name, text in os.environ.items() if name != "ELOCUTE_NO_APT"}
    environment |= {"PATH": f"{tools}:{os.environ['PATH']}", "PYTHON": str(tools / "python")}
    with said.open("a") as file:
        subprocess.run(
            ["bash", "scripts/setup", "demo"],
            cwd=folder,
            env=environment | variables,
            stdout=file,
            stderr=subprocess.STDOUT,
            check=True,
        )
    lines = said.read_text().splitlines()
    return lines[0], [line for line in lines if line.startswith("apt-get")]


def test_root_is_told_the_line_before_it_runs(tmp_path):
    first, asked = setup(tmp_path, user=0)
    line = "apt-get install -y --no-install-recommends libegl1 libegl-mesa0 libgl1-mesa-dri"
    assert first.startswith(f"setup: running, as root: apt-get update && {line} ")
    assert asked == ["apt-get update -qq", f"{line} -qq"]


@pytest.mark.parametrize(("user", "variables"), [(0, {"ELOCUTE_NO_APT": "1"}), (1000, {})])
def test_others_are_told_what_to_run(tmp_path, user, variables):
    first, asked = setup(tmp_path, user, **variables)
    assert first.startswith("setup: for fast rendering and all tests run: sudo apt-get install -y ")
    assert asked == []


def requires_python(name: str) -> str:
    return ",".join(metadata(name).get_all("Requires-Python") or [])


def locked() -> dict[str, list[str]]:
    """`name==version` and its hashes, of everything that development is done with."""
    text = (ROOT / "constraints/dev.txt").read_text(encoding="utf-8")
    entries = re.findall(r"^(\S+==\S+)((?: \\\n +--hash=sha256:[0-9a-f]{64})*)$", text, re.M)
    assert len(entries) == len(re.findall("==", text))
    return {name: hashes.split()[1::2] for name, hashes in entries}


def test_every_pin_has_hashes_and_no_address():
    """pip refuses a file that another has put under the same name and version."""
    assert [name for name, hashes in locked().items() if not hashes] == []
    text = (ROOT / "constraints/dev.txt").read_text(encoding="utf-8")
    assert "://" not in text and not re.search(r"^-", text, re.M)
    assert not any(name.startswith("torch==") for name in locked())


@pytest.mark.skipif(sys.version_info[:2] != (3, 11), reason="the pins are for Python 3.11")
def test_pinned_versions_install_on_every_python_of_their_series():
    """A pin that wants 3.11.5 breaks `make test` on Debian's 3.11.2, and on no newer machine."""
    pins = [pin.partition("==")[0] for pin in locked()]
    assert len(pins) > 100
    wanted = {name: requires_python(name) for name in pins}
    assert {
        name: pythons
        for name, pythons in wanted.items()
        if not SpecifierSet(pythons).contains("3.11.0")
    } == {}
