"""`elocute capture` as people call it."""

from __future__ import annotations

import json
from pathlib import Path

import pytest

from elocute.capture.simulation.scan_simulator import Scanner, simulate_scans
from elocute.head.builtin import load_builtin_head
from elocute.motion.motion import Motion
from elocute.registration.scan_file import read_scan, write_scan
from tests.support.commands import run_here, succeeds


@pytest.fixture(scope="session")
def scan_folder(tmp_path_factory: pytest.TempPathFactory) -> Path:
    import numpy as np

    head = load_builtin_head()
    folder = tmp_path_factory.mktemp("capture") / "scans"
    still = Motion(head, np.zeros((1, len(head.expression_names)), np.float32), 30.0)
    simulate_scans(still, folder, scanner=Scanner(points=15_000))
    return folder


@pytest.mark.slow
def test_one_scan_in_its_own_unit(scan_folder: Path, tmp_path: Path):
    scan = read_scan(scan_folder / "00000.ply")
    write_scan(tmp_path / "mm.ply", 1000 * scan.points, scan.triangles)
    output = tmp_path / "out.obj"
    result = succeeds(
        "capture", "scan", tmp_path / "mm.ply", "-o", output, "--unit", "mm", "--json"
    )
    record = json.loads(result.stdout)
    assert record["surface_mm"]["median"] < 0.09 and record["lost"] == ""
    assert record["landmark_mm"] is None and record["seconds"] > 0
    found = read_scan(output, "mm")
    assert abs(found.points.max(axis=0) - scan.points.max(axis=0)).max() < 0.003


def test_check_of_good_scans(scan_folder: Path):
    shown = succeeds("capture", "check", scan_folder).stdout
    assert "0 errors" in shown and "no sound" in shown


def test_a_picture_that_is_missing_is_told_in_a_line(tmp_path: Path):
    """Nothing is wrong enough to stop; the output is there and what was left out is said."""
    (tmp_path / "a.mtl").write_text("newmtl skin\nmap_Kd skin.png\n")
    (tmp_path / "a.obj").write_text(
        "mtllib a.mtl\nv 0 0 0\nv .2 0 0\nv 0 .2 0\nvt 0 0\nvt 1 0\nvt 0 1\n"
        "usemtl skin\nf 1/1 2/2 3/3\n"
    )
    said = run_here("capture", "landmarks", tmp_path / "a.obj", "-o", tmp_path / "a.html")
    assert said.returncode == 0 and (tmp_path / "a.html").is_file()
    told = f"elocute: {tmp_path / 'a.obj'}: its picture 'skin.png' is not there; its colours are"
    assert said.stderr == f"{told} left out\n"
