"""Registration of scans: a person's own neutral face, then frame after frame.

The sequential fit of VOCA (2019, section 6, after Li et al. 2017): identity once per subject from
a resting face; then pose and expression of every frame, warm from the frame before; then offsets
that are free but smooth. No model spans every person: a neutral face leaves it by non-rigid ICP,
led by landmarks, before its offsets are sought.
"""

from __future__ import annotations

import time
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from elocute.array_types import Float64Array
from elocute.errors import CaptureError
from elocute.head.mesh import with_template
from elocute.head.model import HeadModel
from elocute.registration import free_offsets, model_fit, nonrigid_icp
from elocute.registration.accuracy import (
    SurfaceError,
    landmark_error_mm,
    registration_error,
)
from elocute.registration.correspondences import ScanSamples, sample_scan
from elocute.registration.free_offsets import carry_inner_parts
from elocute.registration.head_search import FAR_MM, face_distance_mm, initial_poses
from elocute.registration.landmarks import Landmarks, no_landmarks
from elocute.registration.model_fit import ModelFit, ModelParameters
from elocute.registration.nonrigid_icp import NonrigidIcp
from elocute.registration.scan import Scan, checked_scan
from elocute.registration.template import Template, adaptive_template, with_size
from elocute.registration.zero_pose import HeadPose, align_head, apply_pose, remove_pose

MODEL_POINTS = 6_000
SEARCH_POINTS = 2_000
SURFACE_POINTS = 40_000
RIVAL = 1.3
"""Places whose first fit is no further off than this times the best are fitted to the end."""
LOST_LANDMARK_MM = 6.0
LOST_COVERED = 0.2
"""Low, as a scan may show clothes and hair: it is the face that tells."""
LOST_FACE = 0.8
LOST_STRANGE_MM, LOST_STRANGE_LED_MM = 3.0, 6.0
"""Without landmarks, and with some. People came to 2.8, faces in wrong places to 3.1 to 8.7."""
NOBODY, LOST_NOBODY_MM = 1.85, 2.2
"""Root mean square of an identity, in standard deviations, beyond which it is nobody's, and how far
from that a face found without landmarks may be. Real people came to 1.7 and 1.5 mm, most
faces in wrong places to 1.84 to 2.1 and more than 3.0 mm."""


@dataclass(frozen=True, eq=False)
class Registration:
    """A scan in the topology of the head.

    Attributes
    ----------
    vertices
        (vertex, 3) m in the scan's own frame.
    zero
        (vertex, 3) m in zero pose.
    parameters
        The model underneath.
    offsets
        (vertex, 3) m in zero pose, what was added to the model.
    surface
        Distance of the scan from the surface.
    landmark_mm
        Mean distance to the landmarks given, or None without any.
    seconds
        Processor time of the registration, without reading and measuring.
    notes
        What had to be removed from the scan.
    """

    vertices: Float64Array
    zero: Float64Array
    parameters: ModelParameters
    offsets: Float64Array
    surface: SurfaceError
    landmark_mm: float | None
    seconds: float
    notes: tuple[str, ...] = ()

    @property
    def lost(self) -> str:
        """Why this registration must not be used, or ""."""
        if self.surface.covered < LOST_COVERED:
            return f"only {100 * self.surface.covered:.0f} % of the scan is near the head"
        if self.surface.face < LOST_FACE:
            return f"only {100 * self.surface.face:.0f} % of the face is in the scan"
        if not self.surface.face_median <= self.surface.limit:
            return f"the face is {self.surface.face_median:.2f} mm off the scan"
        if self.surface.strange > self._strange_allowed:
            return f"the face is {self.surface.strange:.1f} mm from any that the model knows"
        if self.landmark_mm is not None and self.landmark_mm > LOST_LANDMARK_MM:
            return f"the landmarks are {self.landmark_mm:.1f} mm off"
        return ""

    @property
    def _strange_allowed(self) -> float:
        """How far the face may be from the model's, mm."""
        if self.landmark_mm is not None:
            return LOST_STRANGE_LED_MM
        nobody = self.parameters.deviation > NOBODY
        return LOST_NOBODY_MM if nobody else LOST_STRANGE_MM


def register_neutral(
    head: HeadModel, scan: Scan, landmarks: Landmarks, *, method: str = "model"
) -> tuple[Template, Registration]:
    """A person's own template from a scan of a resting face, and that scan's registration.

    What little expression the face shows is taken out of the template by the method "model". "nicp"
    lays the mean face over the scan by non-rigid ICP ("Speech in the wild" 2019, 3.2).

    Parameters
    ----------
    head
        The topology, with identity and expression bases.
    scan
        In metres; `checked_scan` is applied.
    landmarks
        The scan's 68 landmarks; with too few good ones the head is searched for.
    method
        "model" or "nicp".

    Returns
    -------
    The person's template, and the registration: ask its `lost`.

    Raises
    ------
    CaptureError
        For a scan without a head.
    """
    if method == "nicp":
        registration, _ = register_nonrigid(Template(head), scan, landmarks, adapted=False)
        return Template(
            with_template(head, registration.zero.astype(np.float32), head.name)
        ), registration
    general = _general(head)
    head = general.head
    registration = _register(general, ModelFit(general, True), scan, landmarks, None)
    shown = np.tensordot(registration.parameters.expression, general.basis, 1)
    neutral = (registration.zero - shown).astype(np.float32)
    own = with_template(_with_joints(head, registration.parameters), neutral, head.name)
    # The joints were found with the identity; `with_template` would guess them once more.
    joints = head.identity_joints(registration.parameters.identity.astype(np.float32)).astype(
        np.float32
    )
    return Template(replace(own, joint_positions=joints)), registration


@lru_cache(maxsize=1)
def _general(head: HeadModel) -> Template:
    """Anybody's head at rest; what is known of its mesh is worked out once for all people."""
    return Template(with_size(head), mouth_shut=True)


def locate_head(head: HeadModel, scan: Scan) -> HeadPose:
    """Roughly where a head is in a scan without landmarks, however it lies.

    Raises CaptureError for a scan without a head.
    """
    scan, _ = checked_scan(scan)
    template = _general(head)
    fit = ModelFit(template, True)
    return _located(template, fit, scan, sample_scan(scan), no_landmarks()).pose


def _with_joints(head: HeadModel, parameters: ModelParameters) -> HeadModel:
    return (
        head.with_identity(parameters.identity.astype(np.float32))
        if len(parameters.identity)
        else head
    )


def register_scan(
    template: Template, scan: Scan, landmarks: Landmarks, before: Registration | None = None
) -> Registration:
    """Register a scan of a person whose template is known (VOCA 2019, section 6).

    A frame that is lost when started from the frame before is tried once more from scratch, and the
    better of the two is returned.

    Parameters
    ----------
    template
        The person's.
    scan
        In metres; `checked_scan` is applied.
    landmarks
        The scan's 68 landmarks; with too few good ones the head is searched for.
    before
        The frame before, or None to start from scratch.

    Returns
    -------
    The registration: ask its `lost`.

    Raises
    ------
    CaptureError
        For a scan without a head, and where the frame before was fitted with an identity, as a
        neutral face is.
    """
    fit = ModelFit(template, False)
    if before is not None and len(before.parameters.identity):
        raise CaptureError.about(
            "the frame before", found="a fit of an identity", allowed="a result of register_scan"
        )
    scan, notes = checked_scan(scan)
    if before is not None and not before.lost:
        registration = _register(template, fit, scan, landmarks, before, notes)
        if not registration.lost:
            return registration
        again = _register(template, fit, scan, landmarks, None, notes)
        return min(registration, again, key=lambda one: (bool(one.lost), one.surface.median))
    return _register(template, fit, scan, landmarks, None, notes)


def register_nonrigid(
    template: Template,
    scan: Scan,
    landmarks: Landmarks,
    *,
    adapted: bool = True,
    icp: NonrigidIcp | None = None,
    before: Registration | None = None,
) -> tuple[Registration, int]:
    """Register a scan by non-rigid ICP ("Speech in the wild" 2019, 3.2).

    Parameters
    ----------
    template
        The person's.
    scan
        In metres; `checked_scan` is applied.
    landmarks
        The scan's 68 landmarks.
    adapted
        Start from the adaptive template of Eq. 1; otherwise from the neutral face, as usual.
    icp
        Of the same template, so that its factorisations are used again.
    before
        The frame before: its offsets from the template are kept, and fewer steps suffice.

    Returns
    -------
    The registration, and how many steps it took.

    Raises
    ------
    CaptureError
        For a scan without a head.
    """
    started = time.thread_time()
    scan, notes = checked_scan(scan)
    fit = ModelFit(template, False)
    located = _located(template, fit, scan, sample_scan(scan), landmarks)
    parameters = fit.neutral_start(located.pose)
    if adapted and landmarks.enough and len(template.head.landmarks):
        parameters = replace(
            parameters, expression=_landmark_expression(template, landmarks, parameters.pose)
        )
    start = fit.posed_vertices(parameters)
    if before is not None:
        start = start + _posed_offsets(template, before.offsets, parameters.pose)
    levels = nonrigid_icp.COLD_LEVELS if before is None else nonrigid_icp.WARM_LEVELS
    vertices, steps = (icp or NonrigidIcp(template)).register(start, scan, landmarks, levels)
    parameters = replace(parameters, pose=_settled_pose(template, vertices))
    seconds = time.thread_time() - started
    zero = remove_pose(template.head, vertices, parameters.pose)
    registration = Registration(
        vertices,
        zero,
        parameters,
        zero - fit.zero_pose_vertices(parameters),
        registration_error(template, vertices, scan),
        landmark_error_mm(template.head, vertices, landmarks),
        seconds,
        notes,
    )
    return registration, steps


def _register(
    template: Template,
    fit: ModelFit,
    scan: Scan,
    landmarks: Landmarks,
    before: Registration | None,
    notes: tuple[str, ...] | None = None,
) -> Registration:
    started = time.thread_time()
    if notes is None:
        scan, notes = checked_scan(scan)
    samples = sample_scan(scan)
    if not len(samples.points):
        raise CaptureError.about(scan.name, found="nothing but rims", allowed="a surface")
    if before is None:
        parameters = _cold_start(template, fit, scan, samples, landmarks)
        added, stages = None, free_offsets.COLD_STAGES
    else:
        parameters = fit.fit(
            samples.subset(MODEL_POINTS), landmarks, before.parameters, model_fit.WARM_STAGES
        )
        added, stages = (
            _posed_offsets(template, before.offsets, parameters.pose),
            free_offsets.WARM_STAGES,
        )
    model = fit.posed_vertices(parameters)
    some = samples.subset(SURFACE_POINTS, seed=1)
    if fit.with_identity:
        near, _ = NonrigidIcp(template).register(model, scan, landmarks)
        vertices = near + free_offsets.fit_offsets(
            template, near, some, stages=free_offsets.FINE_STAGES
        )
        vertices = carry_inner_parts(template, model, vertices)
    else:
        vertices = model + free_offsets.fit_offsets(
            template, model, some, start=added, stages=stages
        )
    seconds = time.thread_time() - started
    head = _with_joints(template.head, parameters)
    zero = remove_pose(head, vertices, parameters.pose)
    offsets = zero - fit.zero_pose_vertices(parameters)
    return Registration(
        vertices,
        zero,
        parameters,
        offsets,
        registration_error(template, vertices, scan, offsets),
        landmark_error_mm(template.head, vertices, landmarks),
        seconds,
        notes,
    )


def _settled_pose(template: Template, vertices: Float64Array) -> HeadPose:
    """The pose of what speech does not move: an open mouth pulls landmarks, and so a first pose."""
    still = template.still
    return align_head(template.head, template.vertices[still], vertices[still])


def _cold_start(
    template: Template, fit: ModelFit, scan: Scan, samples: ScanSamples, landmarks: Landmarks
) -> ModelParameters:
    """From scratch: pose by landmarks or search, expression by Eq. 1, then the model fit."""
    start = _located(template, fit, scan, samples, landmarks)
    if landmarks.enough and len(template.head.landmarks) and not fit.with_identity:
        start = replace(start, expression=_landmark_expression(template, landmarks, start.pose))
    return fit.fit(samples.subset(MODEL_POINTS), landmarks, start, fit.cold_stages)


def _located(
    template: Template, fit: ModelFit, scan: Scan, samples: ScanSamples, landmarks: Landmarks
) -> ModelParameters:
    """Where the head is. Of several places the one where a fitted face lies nearest to the scan.

    Raises CaptureError where there is no head.
    """
    starts = [fit.neutral_start(pose) for pose in initial_poses(template, samples, landmarks)]
    if landmarks.enough and len(starts) == 1:
        return starts[0]
    some = samples.subset(SEARCH_POINTS)
    tried = [fit.fit(some, no_landmarks(), start, fit.cold_stages[:2]) for start in starts]
    apart = [face_distance_mm(template, fit.posed_vertices(one), samples) for one in tried]
    if not apart or min(apart) > FAR_MM:
        raise CaptureError.about(
            scan.name,
            found="no head",
            allowed="a scan with a face",
            remedy="give its landmarks",
        )
    rivals = [tried[place] for place in np.argsort(apart) if apart[place] < RIVAL * min(apart)]
    if len(rivals) == 1:
        return rivals[0]
    fitted = [fit.fit(some, no_landmarks(), one, fit.cold_stages) for one in rivals]
    near = [face_distance_mm(template, fit.posed_vertices(one), samples) for one in fitted]
    return rivals[int(np.argmin(near))]


def _landmark_expression(template: Template, landmarks: Landmarks, pose: HeadPose) -> Float64Array:
    """(expression,) that the landmarks show, moved into the frame of the head (Eq. 1)."""
    low, high = model_fit.BOUNDS
    places = np.nan_to_num(landmarks.points)
    frame = np.zeros_like(template.vertices)
    frame[template.head.landmarks] = places
    back = remove_pose(template.head, frame, pose)[template.head.landmarks]
    _, coefficients = adaptive_template(template, Landmarks(back, landmarks.confidence))
    return np.clip(coefficients, low, high)


def _posed_offsets(template: Template, added: Float64Array, pose: HeadPose) -> Float64Array:
    """(vertex, 3) m: offsets in zero pose, turned with the head."""
    base = apply_pose(template.head, template.vertices, pose)
    return apply_pose(template.head, template.vertices + added, pose) - base
