"""`elocute capture landmarks`: where the 68 are, from a detector that knows 478 other points."""

from __future__ import annotations

import importlib.util
import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from elocute.capture.scans.landmark_detection import (
    _landmark_shares,
    detect_landmarks,
    find_landmarks,
)
from elocute.capture.simulation.scan_simulator import Scanner, simulate_scans
from elocute.capture.video.face_mesh_points import builtin_face_points
from elocute.head.identity import sample_identity
from elocute.head.model import HeadModel
from elocute.motion.edits import cut
from elocute.motion.motion import Motion
from elocute.registration.landmarks import read_landmarks
from elocute.registration.scan import Scan
from tests.support.commands import refused, run_here

HAS_MEDIAPIPE = importlib.util.find_spec("mediapipe") is not None


@pytest.mark.parametrize("seed", [3, 7])
def test_points_of_another_face_give_its_landmarks(head: HeadModel, seed: int):
    person = head.with_identity(sample_identity(seed))
    shares, confidence = _landmark_shares()
    found = shares[:, :468] @ builtin_face_points().on(person.template)[:468]
    apart = 1000 * np.linalg.norm((found - person.template[person.landmarks])[:, :2], axis=1)
    assert np.median(apart[confidence > 0.3]) < 1.0
    assert shares.sum(axis=1) == pytest.approx(np.ones(68))


@pytest.mark.skipif(not HAS_MEDIAPIPE, reason="needs the extra `video` (mediapipe==0.10.21)")
def test_landmarks_of_a_sequence(motion: Motion, tmp_path: Path):
    """Scans fine enough to be looked at; one of them is junk, and does not stop the others."""
    folder = tmp_path / "sequence"
    simulate_scans(cut(motion, 0.0, 0.15), folder, scanner=Scanner(points=60_000))
    (folder / "landmarks").rename(tmp_path / "truth")
    (folder / "00001.ply").write_text("junk")
    result = run_here("capture", "landmarks", folder, "--json")
    record = json.loads(result.stdout.splitlines()[-1])
    assert result.returncode == 1 and record["found"] == 2
    assert "00001.ply" in record["failed"][0]
    for name in ("00000.json", "00002.json"):
        found, truth = (
            read_landmarks(folder / "landmarks" / name),
            read_landmarks(tmp_path / "truth" / name),
        )
        apart = np.linalg.norm(found.points - truth.points, axis=1)
        assert np.median(apart[found.good]) < 0.004
    again = run_here("capture", "landmarks", folder, "--json")
    assert json.loads(again.stdout.splitlines()[-1])["found"] == 0


@pytest.mark.skipif(HAS_MEDIAPIPE, reason="the extra `video` is installed")
def test_without_the_extra_it_says_what_to_install(sequence_folder: Path):
    result = run_here("capture", "landmarks", sequence_folder)
    assert result.returncode != 0 and "elocute[video]" in result.stderr


def test_one_scan_needs_a_place(sequence_folder: Path, tmp_path: Path):
    scan = sequence_folder / "00000.ply"
    refused("capture", "landmarks", scan, says="no -o")
    place = tmp_path / "marks.txt"
    refused("capture", "landmarks", scan, "-o", place, says="allowed: .json")


@pytest.mark.slow
def test_a_scan_is_shown_without_its_colours_and_turned_to_the_camera(
    head: HeadModel, scans: list[Scan]
):
    """A detector that sees no face is shown all there is: of a scan that lies on its back, too."""
    seen: list[np.ndarray] = []
    down = np.array([[1.0, 0, 0], [0, 0, 1], [0, -1, 0]])
    lying = replace(scans[0], points=scans[0].points @ down.T)
    assert not find_landmarks(head, lying, seen.append).good.any()
    pictures = {}
    for name, scan in (("as it lies", lying), ("upright", scans[0])):
        for colors in (scan.colors, None):
            shown: list[np.ndarray] = []
            detect_landmarks(replace(scan, colors=colors), shown.append)
            pictures[name, colors is None] = shown
    assert len(seen) == 20
    assert (seen[0] == pictures["as it lies", False][0]).all()
    assert (seen[5] == pictures["as it lies", True][0]).all()
    for first, grey in ((10, False), (15, True)):
        apart = [
            np.abs(seen[first].astype(float) - pictures[way, grey][0]).mean()
            for way in ("upright", "as it lies")
        ]
        assert apart[0] < 0.5 * apart[1]
