"""Simulated scans that several tests read: coarse, so that each registers in a second."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from elocute.audio.waveform import Waveform
from elocute.capture.scans.scan_sequence import SequenceMetadata
from elocute.capture.simulation.scan_simulator import Scanner, ScanSimulator, simulate_scans
from elocute.head.builtin import load_builtin_head
from elocute.head.identity import sample_identity
from elocute.head.model import HeadModel
from elocute.motion.motion import Motion
from elocute.registration.landmarks import no_landmarks
from elocute.registration.register import Registration, register_neutral
from elocute.registration.scan import Scan, checked_scan
from elocute.registration.template import Template

FRAMES, FPS, POINTS = 6, 20.0, 15_000


@pytest.fixture(scope="session")
def head() -> HeadModel:
    return load_builtin_head()


@pytest.fixture(scope="session")
def motion(head: HeadModel) -> Motion:
    """Somebody rests, then opens the mouth and blinks."""
    person = head.with_identity(sample_identity(7))
    weights = np.zeros((FRAMES, len(head.expression_names)), np.float32)
    rise = np.linspace(0, 1, FRAMES)
    for name, top in (("jawOpen", 0.7), ("mouthPucker", 0.4), ("eyeBlinkLeft", 0.6)):
        weights[:, head.expression_index(name)] = top * rise
    return Motion(person, weights, FPS)


@pytest.fixture(scope="session")
def stage(motion: Motion) -> ScanSimulator:
    return ScanSimulator(motion, Scanner(points=POINTS, seed=4))


@pytest.fixture(scope="session")
def scans(stage: ScanSimulator) -> list[Scan]:
    """One for each frame, textured."""
    taken = [stage.frame(frame) for frame in range(FRAMES)]
    return [
        checked_scan(Scan(f"frame {number}", one.points, one.triangles, one.colors))[0]
        for number, one in enumerate(taken)
    ]


@pytest.fixture(scope="session")
def neutral(
    head: HeadModel, stage: ScanSimulator, scans: list[Scan]
) -> tuple[Template, Registration]:
    return register_neutral(head, scans[0], stage.frame(0).landmarks)


@pytest.fixture(scope="session")
def unaided(head: HeadModel, scans: list[Scan]) -> Registration:
    """The first scan, registered without landmarks."""
    return register_neutral(head, scans[0], no_landmarks())[1]


@pytest.fixture(scope="session")
def sequence_folder(tmp_path_factory: pytest.TempPathFactory, motion: Motion) -> Path:
    folder = tmp_path_factory.mktemp("scans") / "sequence"
    hum = 0.3 * np.sin(2 * np.pi * 200 * np.arange(16000) / 16000).astype(np.float32)
    simulate_scans(
        motion,
        folder,
        scanner=Scanner(points=POINTS, seed=4),
        metadata=SequenceMetadata(subject="anna", sentence="ah", neutral=0),
        sound=Waveform(hum, 16000),
    )
    return folder
