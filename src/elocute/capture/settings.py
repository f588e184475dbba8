"""Settings of registration and of the simulated scanner."""

from __future__ import annotations

from dataclasses import dataclass

from elocute.errors import CaptureError
from elocute.jobs.pool import JOBS_MAX
from elocute.settings import check_settings, described, setting

METHODS = ("model", "nicp")
TEMPLATES = ("adaptive", "fixed")


@described
@dataclass(frozen=True)
class BatchSettings:
    """How folders of scans are registered.

    `method` "model" is VOCA's (2019, section 6); "nicp" with an adaptive `template` is that of
    "3D facial motion from in-the-wild speech" (2019, section 3.2).

    Raises
    ------
    CaptureError
        For a number outside its range.
    """

    head: str = setting(
        "builtin", help="Head whose mesh is registered: builtin, a FLAME model or a head file."
    )
    fps: float | None = setting(
        None,
        unit="frames/s",
        above=0,
        high=1000.0,
        help="Frame rate; overrides that of capture.json.",
    )
    unit: str | None = setting(
        None,
        help="Unit of the coordinates (m, mm, cm, dm or inch); overrides that of capture.json.",
    )
    jobs: int = setting(
        1, low=0, high=JOBS_MAX, help="Number of processes; 0 takes all processors."
    )
    eyes_ms: float = setting(
        20.0,
        unit="ms",
        low=0.0,
        high=1000.0,
        help="Standard deviation of the smoothing around the eyes; 0 for none.",
    )

    method: str = setting(
        "model",
        choices=METHODS,
        help="Registration: model fits the head model, then deforms it freely; nicp is non-rigid "
        "ICP.",
    )
    template: str | None = setting(
        None,
        choices=TEMPLATES,
        help="Shape that nicp starts from: adaptive, the neutral face with the expression that the "
        "landmarks show (the default), or fixed, the neutral face.",
    )

    def __post_init__(self) -> None:
        check_settings(self, CaptureError)
        if self.template is not None and self.method != "nicp":
            raise CaptureError.about(
                "`template`", found=f"`method` {self.method}", allowed="with `method` nicp only"
            )

    @property
    def adapted(self) -> bool:
        """Whether non-rigid ICP starts from the adaptive template."""
        return self.template != "fixed"


@described
@dataclass(frozen=True)
class Scanner:
    """How simulated scans are taken.

    Half of the noise is drawn pixel by pixel, half is spread over neighbours, as stereo matching
    does. The neck turns half as far as the head beside it.

    Raises
    ------
    CaptureError
        For a number outside its range.
    """

    points: int = setting(120_000, low=2_000, high=1_000_000, help="Points of each scan, roughly.")
    noise_mm: float = setting(
        0.1,
        unit="mm",
        low=0.0,
        high=100.0,
        help="Standard deviation of the noise along the camera's ray.",
    )
    landmark_mm: float = setting(
        0.7,
        unit="mm",
        low=0.0,
        high=100.0,
        help="Standard deviation of each coordinate of the 68 landmarks.",
    )
    bumps_mm: float = setting(
        0.4,
        unit="mm",
        low=0.0,
        high=100.0,
        help="Standard deviation of bumps that no model explains, on face and mouth.",
    )
    turn_deg: float = setting(
        8.0, unit="degrees", low=0.0, high=100.0, help="Amplitude of the head's turns."
    )
    shift_mm: float = setting(
        15.0, unit="mm", low=0.0, high=100.0, help="Amplitude of the head's movement."
    )
    holes: float = setting(
        0.6, low=0.0, high=1.0, help="Share of hair and of the inside of the mouth that is missing."
    )
    textured: bool = setting(True, help="Whether vertices have colours.")
    seed: int = setting(0, low=0, help="The same seed gives the same scans.")

    def __post_init__(self) -> None:
        check_settings(self, CaptureError)
