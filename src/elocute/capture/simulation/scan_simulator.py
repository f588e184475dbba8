"""Simulated scans with known truth: a head in motion, seen by a scanner in software.

What a model-based registration could recover exactly is avoided on purpose: the surface is rounded
between the template's vertices, the face has bumps that no identity has, and the mouth moves in
ways that no expression has: by a few bumps that swing, or, of a `PosedTake`, by its own vertices.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float32Array, Float64Array
from elocute.audio.waveform import Waveform
from elocute.audio.write import write_flac
from elocute.capture.scans.scan_sequence import SequenceMetadata, write_metadata
from elocute.capture.settings import Scanner
from elocute.capture.simulation.range_scanner import (
    RangeImage,
    Subdivision,
    phong_tessellation,
    render_range_images,
    subdivide_triangles,
    triangulate_range_image,
)
from elocute.errors import CaptureError
from elocute.files.array_writing import RowWriter, save_npy
from elocute.files.atomic import write_folder_atomically
from elocute.head.model import HeadModel
from elocute.head.skinning import joint_transforms
from elocute.motion.motion import Motion
from elocute.numerics.quaternions import from_axis_angle, multiply, no_turn
from elocute.one_line_repr import one_line
from elocute.registration.landmarks import Landmarks, write_landmarks
from elocute.registration.scan_file import write_scan

PARTS = 3  # each template triangle becomes PARTS² on the rounded surface
BUMPS, BUMP_WIDTH_M = 60, 0.012
MOUTH_BUMPS, MOUTH_WIDTH_M = 6, 0.008
WET_MATERIALS = ("mouth", "teeth", "gums", "tongue")  # wet and dark: stereo sees little of it
UNSCANNED_MATERIALS = ("hair",)


class PosedTake(Protocol):
    """A take of a face that moves as no rig does: vertices in zero pose, and turns of joints.

    Attributes
    ----------
    rotations
        (frame, joint, 4) unit quaternions wxyz.
    """

    @property
    def head(self) -> HeadModel: ...
    @property
    def rotations(self) -> Float32Array: ...
    @property
    def fps(self) -> float: ...
    @property
    def frame_count(self) -> int: ...
    @property
    def duration_s(self) -> float: ...
    def vertices(self, start: int = 0, stop: int | None = None) -> Float32Array: ...


@dataclass(frozen=True, eq=False)
class GroundTruth:
    """What was scanned: vertices (vertex, 3) m of the head's topology, posed and in zero pose.

    translation (3,) m and turns (joint, 4), unit quaternions wxyz, lead from zero pose to posed.
    """

    posed: Float64Array
    zero: Float64Array
    translation: Float64Array
    turns: Float64Array


@dataclass(frozen=True, eq=False)
class ScannedFrame:
    """One simulated scan and its truth: where the template's vertices were.

    points: (point, 3) m. triangles: (triangle, 3). colors: (point, 3) uint8 sRGB, or None.
    landmarks: with the scanner's noise.
    """

    points: Float64Array
    triangles: NDArray[np.int32]
    colors: NDArray[np.uint8] | None
    landmarks: Landmarks
    truth: GroundTruth

    __repr__ = one_line


@dataclass(frozen=True, eq=False)
class ScanSimulator:
    """A motion of a head that names its regions and landmarks, in front of a scanner.

    `frame` scans one frame of it.
    """

    motion: Motion | PosedTake
    scanner: Scanner

    @property
    def head(self) -> HeadModel:
        return self.motion.head

    @cached_property
    def triangles(self) -> NDArray[np.int32]:
        """(triangle, 3) of what a scanner can see."""
        names = self.head.material_names
        unseen = [index for index, name in enumerate(names) if name in UNSCANNED_MATERIALS]
        return self.head.triangles[~np.isin(self.head.triangle_material, unseen)]

    @cached_property
    def refinement(self) -> Subdivision:
        return subdivide_triangles(self.triangles, PARTS)

    @cached_property
    def bumps(self) -> Float64Array:
        """(vertex, 3) m that this face has beyond its identity."""
        rng = np.random.default_rng(self.scanner.seed)
        places = self.head.template[self.head.regions["skin"]]
        return self._bumps(rng, places, BUMPS, BUMP_WIDTH_M)

    @cached_property
    def mouth_bumps(self) -> Float64Array:
        """(bump, vertex, 3) m by which the mouth moves beyond its expressions."""
        rng = np.random.default_rng(self.scanner.seed + 1)
        places = self.head.template[self.head.regions["lips"]]
        each = [self._bumps(rng, places, 1, MOUTH_WIDTH_M) for _ in range(MOUTH_BUMPS)]
        return np.stack(each)

    @cached_property
    def spacing_m(self) -> float:
        """Pixel that gives about as many points as were asked for, on the neutral face."""
        surface = phong_tessellation(self.head.template, self.triangles, self.refinement)
        coarse, rng = 0.003, np.random.default_rng(self.scanner.seed)
        views = render_range_images(surface, self.refinement.triangles, coarse, np.zeros(2))
        count = sum(int((~self._dropouts(seen, rng)).sum()) for seen in views)
        return coarse * float(np.sqrt(count / self.scanner.points))

    def _bumps(
        self, rng: np.random.Generator, places: NDArray[np.float32], count: int, width_m: float
    ) -> Float64Array:
        """(vertex, 3) m: `count` round bumps, of which about one affects any vertex."""
        template = self.head.template.astype(np.float64)
        total = np.zeros_like(template)
        for place in places[rng.integers(len(places), size=count)]:
            far = ((template - place) ** 2).sum(axis=1) / width_m**2
            total += np.exp(-far / 2)[:, None] * rng.normal(0, self.scanner.bumps_mm / 1000, 3)
        return total

    def truth(self, frame: int) -> GroundTruth:
        """Where every vertex is at a frame."""
        seconds = frame / self.motion.fps
        zero = self.motion.vertices(frame, frame + 1)[0].astype(np.float64) + self.bumps
        if isinstance(self.motion, Motion):
            phases = np.arange(MOUTH_BUMPS)
            swing = np.sin(2 * np.pi * (1.3 + 0.4 * phases) * seconds + phases)
            zero = zero + np.tensordot(swing, self.mouth_bumps, 1)
        wave = np.sin(2 * np.pi * np.outer(seconds + np.arange(3), [0.31, 0.47, 0.23]))
        turns = no_turn(len(self.head.joint_names)).astype(np.float64)
        if "head" in self.head.joint_names:
            turns[self.head.joint_names.index("head")] = from_axis_angle(
                np.radians(self.scanner.turn_deg / 2) * wave[1]
            )
        turns[0] = from_axis_angle(np.radians(self.scanner.turn_deg) * wave[0])
        if not isinstance(self.motion, Motion):
            turns = multiply(turns, self.motion.rotations[frame])
        translation = self.scanner.shift_mm / 1000 * wave[2]
        rotations, shifts = joint_transforms(
            turns, self.head.joint_positions.astype(np.float64), self.head.joint_parents
        )
        weights = self.head.skin_weights.astype(np.float64)
        matrices = np.tensordot(weights, rotations, 1)
        posed = np.einsum("vab,vb->va", matrices, zero) + weights @ shifts + translation
        return GroundTruth(posed, zero, translation, turns)

    def frame(self, frame: int) -> ScannedFrame:
        """Scan one frame."""
        truth = self.truth(frame)
        rng = np.random.default_rng((self.scanner.seed, 2, frame))
        fine = self.refinement
        surface = phong_tessellation(truth.posed, self.triangles, fine)
        views = render_range_images(surface, fine.triangles, self.spacing_m, rng.random(2))
        patches = [self._view_mesh(seen, surface, rng) for seen in views]
        points, triangles, colors = _joined(patches)
        return ScannedFrame(
            points,
            triangles,
            colors if self.scanner.textured else None,
            self._landmarks(truth, rng),
            truth,
        )

    def _view_mesh(
        self, seen: RangeImage, surface: Float64Array, rng: np.random.Generator
    ) -> tuple[Float64Array, NDArray[np.int32], NDArray[np.uint8]]:
        """One camera's points with noise, its triangles and colours."""
        fine = self.refinement
        corners = fine.triangles[seen.triangle]
        exact = np.einsum("pc,pca->pa", seen.bary, surface[corners])
        depth = _stereo_noise(seen, rng) * self.scanner.noise_mm / 1000
        points = exact + depth[:, None] * seen.ray
        kept = ~self._dropouts(seen, rng)
        triangles = triangulate_range_image(seen, points, self.spacing_m, kept)
        shares = np.einsum("pc,pck->pk", seen.bary, fine.bary[corners])
        colors = self.head.vertex_color[self.triangles[fine.parent[corners[:, 0]]]]
        painted = np.einsum("pk,pka->pa", shares, colors.astype(np.float64))
        return points, triangles, np.clip(painted + 0.5, 0, 255).astype(np.uint8)

    def _dropouts(self, seen: RangeImage, rng: np.random.Generator) -> NDArray[np.bool_]:
        """(point,) where stereo fails: patches of the hair and inside the mouth."""
        parents = self.refinement.parent[self.refinement.triangles[seen.triangle, 0]]
        lost = _dropout_field(seen.cell, rng) < self.scanner.holes
        return lost & self._dropout_prone[parents]

    @cached_property
    def _dropout_prone(self) -> NDArray[np.bool_]:
        """(triangle,) whether stereo sometimes fails there."""
        names = self.head.material_names
        unseen = [index for index, name in enumerate(names) if name in UNSCANNED_MATERIALS]
        inside = [index for index, name in enumerate(names) if name in WET_MATERIALS]
        material = self.head.triangle_material
        scalp = np.zeros(self.head.vertex_count, bool)
        scalp[self.head.regions["scalp"]] = True
        hard = np.isin(material, inside) | scalp[self.head.triangles].any(axis=1)
        return hard[~np.isin(material, unseen)]

    def _landmarks(self, truth: GroundTruth, rng: np.random.Generator) -> Landmarks:
        points = truth.posed[self.head.landmarks]
        noise = rng.normal(0, self.scanner.landmark_mm / 1000, points.shape)
        return Landmarks(points + noise, np.ones(len(points)))


def simulate_scans(
    motion: Motion | PosedTake,
    folder: str | Path,
    *,
    scanner: Scanner | None = None,
    metadata: SequenceMetadata | None = None,
    sound: Waveform | None = None,
    progress: Callable[[float], None] | None = None,
) -> None:
    """Write a folder of simulated scans of a motion, and the truth beside them.

        00000.ply …         in metres
        landmarks/          00000.json …
        truth/vertices.npy  (frame, vertex, 3) m, where the template's vertices were
        truth/zero.npy      (frame, vertex, 3) m, the same in zero pose
        truth/template.npy  (vertex, 3) m, the neutral face

    Parameters
    ----------
    motion
        Of a head that names its regions and landmarks; the scans have its frame rate.
    folder
        A new folder.
    scanner
        How scans are taken.
    metadata
        Subject, sentence and text for capture.json.
    sound
        Written beside the scans, as long as the motion.
    progress
        Called with the share of the frames that are done, 0 to 1.

    Raises
    ------
    OutputError
        For a folder that exists.
    CaptureError
        For a head without regions and landmarks.
    """
    if not len(motion.head.landmarks) or "scalp" not in motion.head.regions:
        raise CaptureError.about(
            f"head {motion.head.name!r}",
            found="names no regions or landmarks",
            allowed="the built-in head",
        )
    simulator = ScanSimulator(motion, scanner or Scanner())
    metadata = replace(metadata or SequenceMetadata(), fps=motion.fps, unit="m")
    with write_folder_atomically(folder) as draft:
        if sound is not None:
            metadata = replace(metadata, sound="sound.flac")
            _write_sound(draft / metadata.sound, sound, motion.duration_s)
        write_metadata(draft, metadata)
        (draft / "landmarks").mkdir()
        (draft / "truth").mkdir()
        template = (motion.head.template + simulator.bumps).astype(np.float32)
        save_npy(draft / "truth" / "template.npy", template)
        with (
            RowWriter(draft / "truth" / "vertices.npy", template.shape) as posed,
            RowWriter(draft / "truth" / "zero.npy", template.shape) as zero,
        ):
            for number in range(motion.frame_count):
                scanned = simulator.frame(number)
                write_scan(
                    draft / f"{number:05d}.ply", scanned.points, scanned.triangles, scanned.colors
                )
                write_landmarks(draft / "landmarks" / f"{number:05d}.json", scanned.landmarks)
                posed.add(scanned.truth.posed[None])
                zero.add(scanned.truth.zero[None])
                if progress:
                    progress((number + 1) / motion.frame_count)


def _write_sound(path: Path, sound: Waveform, seconds: float) -> None:
    """As much of the sound as there is motion, in 16 bits."""
    write_flac(path, sound.samples[: round(seconds * sound.sample_rate)], sound.sample_rate)


def _stereo_noise(seen: RangeImage, rng: np.random.Generator) -> Float64Array:
    """(point,) standard normal: half of the variance from pixel to pixel, half over about five."""
    if not len(seen.cell):
        return np.zeros(0)
    smooth = _noise_field(seen.cell, rng, 5.0)
    return np.sqrt(0.5) * (rng.normal(size=len(smooth)) + smooth)


def _dropout_field(cells: NDArray[np.intp], rng: np.random.Generator) -> Float64Array:
    """(point,) 0 to 1, uniformly distributed, correlated over about twelve pixels."""
    if not len(cells):
        return np.zeros(0)
    field = _noise_field(cells, rng, 12.0)
    return np.argsort(np.argsort(field)) / len(field)


def _noise_field(cells: NDArray[np.intp], rng: np.random.Generator, width: float) -> Float64Array:
    """(point,) standard normal noise on a grid of pixels, correlated over `width` of them."""
    from scipy.ndimage import gaussian_filter

    noise = gaussian_filter(rng.normal(size=cells.max(axis=0) + 1), width / 2)
    return (noise / noise.std())[cells[:, 0], cells[:, 1]]


def _joined(
    patches: list[tuple[Float64Array, NDArray[np.int32], NDArray[np.uint8]]],
) -> tuple[Float64Array, NDArray[np.int32], NDArray[np.uint8]]:
    """One mesh of several, without points that no triangle uses."""
    points = np.concatenate([patch[0] for patch in patches])
    colors = np.concatenate([patch[2] for patch in patches])
    starts = np.cumsum([0, *(len(patch[0]) for patch in patches[:-1])])
    triangles = np.concatenate(
        [patch[1] + start for patch, start in zip(patches, starts, strict=True)]
    )
    used = np.zeros(len(points), bool)
    used[triangles] = True
    places = np.cumsum(used) - 1
    return points[used], places[triangles].astype(np.int32), colors[used]
