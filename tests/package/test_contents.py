"""A wheel and a source distribution hold what is needed, and nothing else."""

from __future__ import annotations

import subprocess
import tarfile
import zipfile
from pathlib import Path

import pytest

from tests.support.commands import run_python

pytest.importorskip("hatchling", reason="needs the development environment")

pytestmark = pytest.mark.slow
ROOT = Path(__file__).parents[2]
VIEWER = {
    "viewer.js",
    "viewer.html",
    "landmarks.js",
    "landmarks.html",
    "live.js",
    "live.html",
    "studio.js",
    "studio.html",
    "viewer.sha256",
    "THIRD_PARTY_NOTICES.txt",
}
LICENCES = [
    "LICENSE",
    "NOTICE",
    "SECURITY.md",
    *(f"docs/cards/{p.name}" for p in (ROOT / "docs/cards").glob("*.md")),
]


def build(kind: str, source: Path, folder: Path) -> Path:
    run_python("-m", "hatchling", "build", "-t", kind, "-d", folder, cwd=source, check=True)
    (built,) = folder.glob("elocute-*")
    return built


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build("wheel", ROOT, tmp_path_factory.mktemp("wheel"))


@pytest.fixture(scope="module")
def sdist(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return build("sdist", ROOT, tmp_path_factory.mktemp("sdist"))


def tracked(folder: str) -> set[str]:
    """Files that Git knows below a folder of the repository and that are there."""
    told = subprocess.run(
        ["git", "ls-files", folder], cwd=ROOT, check=True, capture_output=True, text=True
    )
    return {name for name in told.stdout.splitlines() if (ROOT / name).is_file()}


def names(wheel: Path) -> set[str]:
    with zipfile.ZipFile(wheel) as file:
        return set(file.namelist())


def test_the_wheel_holds_the_package_and_the_viewer(wheel):
    package = {name.removeprefix("src/") for name in tracked("src/elocute")}
    viewer = {f"elocute/export/assets/{name}" for name in VIEWER}
    assert {name for name in names(wheel) if name.startswith("elocute/")} == package | viewer


def test_licences_and_cards_travel_with_the_wheel(wheel):
    with zipfile.ZipFile(wheel) as file:
        for name in LICENCES:
            if not (ROOT / name).is_file():
                continue
            assert (
                file.read(f"elocute-0.1.0.dist-info/licenses/{name}") == (ROOT / name).read_bytes()
            )
        notice = file.read("elocute/export/assets/THIRD_PARTY_NOTICES.txt").decode()
    for package in ("three.js", "Preact", "Preact Signals"):
        assert f"{package}\n" in notice
    assert notice.count("MIT") >= 3


def test_every_dependency_has_both_bounds(wheel):
    with zipfile.ZipFile(wheel) as file:
        facts = file.read("elocute-0.1.0.dist-info/METADATA").decode()
    needed = [line for line in facts.splitlines() if line.startswith("Requires-Dist: ")]
    assert len(needed) > 20
    for line in needed:
        assert "==" in line.split(";")[0] or ("<" in line and ">=" in line), line


def test_the_source_distribution_builds_the_same_wheel(sdist, wheel, tmp_path):
    with tarfile.open(sdist) as file:
        file.extraction_filter = getattr(tarfile, "data_filter", None)  # since Python 3.11.4
        file.extractall(tmp_path)
    (source,) = tmp_path.iterdir()
    again = build("wheel", source, tmp_path / "again")
    assert names(again) == names(wheel)
