"""One HTML page per sequence, self-contained: errors, worst frames, flagged frames."""

from __future__ import annotations

import base64
import html
import io
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from elocute.capture.sequence_tracking import (
    FrameRecord,
    SequenceResult,
    TrackedSequence,
    read_pose,
    read_zero,
)
from elocute.errors import CaptureError, MachineError
from elocute.files.atomic import write_atomically
from elocute.head.mesh import head_from_arrays
from elocute.head.model import HeadModel
from elocute.numerics.quaternions import to_matrices
from elocute.registration.landmarks import Landmarks
from elocute.registration.scan import Scan, checked_scan
from elocute.registration.zero_pose import HeadPose, apply_pose
from elocute.render import Camera, open_renderer, portrait

RgbImage = NDArray[np.uint8]

WORST, FLAGGED = 4, 4
SIDE = 420
WIDTH, HEIGHT, LEFT = 960, 200, 56
STYLE = """
body { font: 15px system-ui, sans-serif; max-width: 1000px; margin: 2em auto; color: #222; }
table { border-collapse: collapse } td, th { padding: 2px 14px 2px 0; text-align: left }
figure { margin: 1em 0 } figcaption { color: #555 } img { max-width: 100% }
text { font-size: 12px; fill: #555 } .bad { color: #a22 }
"""


def write_report(track: TrackedSequence, result: SequenceResult, path: Path) -> None:
    """Error curves, the worst frames beside their scans with landmarks drawn, and all flagged
    frames.

    Raises OutputError.
    """
    records = list(track.records().values())
    good = [record for record in records if not record.flag and record.surface is not None]
    flagged = [record for record in records if record.flag]
    worst = sorted(good, key=lambda record: -(record.surface.p95 if record.surface else 0))
    parts = [
        f"<h1>{html.escape(result.name)}</h1>",
        _table(result),
        _curve(
            "distance from scan to surface, mm: median and 95th percentile",
            [
                [(one.number, one.surface.median) for one in good if one.surface],
                [(one.number, one.surface.p95) for one in good if one.surface],
            ],
            flagged,
        ),
        _curve(
            "landmarks, mm",
            [[(one.number, one.landmark_mm) for one in good if one.landmark_mm is not None]],
            flagged,
        ),
        "<h2>Worst frames</h2>",
        *(_figure(track, record) for record in worst[:WORST]),
    ]
    if flagged:
        parts.append(f"<h2>Flagged frames ({len(flagged)})</h2>")
        parts += [_figure(track, record) for record in flagged[:FLAGGED]]
        parts.append("<ul>" + "".join(map(_item, flagged)) + "</ul>")
    page = (
        f'<!doctype html><html lang="en"><meta charset="utf-8"><title>{html.escape(result.name)}'
        f"</title><style>{STYLE}</style><body>{''.join(parts)}</body></html>"
    )
    with write_atomically(path) as draft:
        draft.write_text(page, encoding="utf-8")


def _table(result: SequenceResult) -> str:
    rows: dict[str, object] = {
        "frames": result.frames,
        "flagged": len(result.flagged),
        "missing": len(result.missing),
        "median, mm": result.median_mm,
        "95th percentile, mm": result.p95_mm,
        "landmarks, mm": result.landmark_mm,
        "seconds a frame": result.seconds_per_frame,
    }
    if result.failed:
        rows = {"failed": result.failed, **rows}
    cells = "".join(
        f"<tr><th>{name}</th><td>"
        f"{f'{value:.3f}' if isinstance(value, float) else html.escape(str(value))}</td></tr>"
        for name, value in rows.items()
        if value is not None
    )
    return f"<table>{cells}</table>"


def _item(record: FrameRecord) -> str:
    return f'<li class="bad">{record.number}: {html.escape(record.flag)}</li>'


def _curve(title: str, lines: list[list[tuple[int, float]]], flagged: Sequence[FrameRecord]) -> str:
    """An inline SVG of values over frame numbers; flagged frames are red ticks."""
    points = [point for line in lines for point in line]
    if not points:
        return ""
    numbers = [number for number, _ in points] + [record.number for record in flagged]
    first, last = min(numbers), max(max(numbers), min(numbers) + 1)
    top = max(value for _, value in points) * 1.1 or 1.0

    def place(number: int, value: float) -> str:
        x = LEFT + (WIDTH - LEFT - 10) * (number - first) / (last - first)
        return f"{x:.1f},{HEIGHT - 24 - (HEIGHT - 34) * value / top:.1f}"

    drawn = "".join(
        f'<polyline fill="none" stroke="{ink}" stroke-width="1.5" '
        f'points="{" ".join(place(*point) for point in line)}"/>'
        for line, ink in zip(lines, ("#1f5fa8", "#b4482b"), strict=False)
    )
    for record in flagged:
        x = place(record.number, 0).split(",")[0]
        drawn += f'<line x1="{x}" x2="{x}" y1="10" y2="{HEIGHT - 24}" stroke="#d33"/>'
    for share in (0.0, 0.5, 1.0):
        y = place(first, share * top).split(",")[1]
        drawn += f'<text x="{LEFT - 6}" y="{y}" text-anchor="end">{share * top:.2f}</text>'
    drawn += f'<text x="{LEFT}" y="{HEIGHT - 6}">{first}</text>'
    drawn += f'<text x="{WIDTH - 10}" y="{HEIGHT - 6}" text-anchor="end">{last}</text>'
    return f'<h2>{title}</h2><svg viewBox="0 0 {WIDTH} {HEIGHT}" width="100%">{drawn}</svg>'


def _figure(track: TrackedSequence, record: FrameRecord) -> str:
    try:
        pictures = _frame_pictures(track, record)
    except (CaptureError, MachineError) as error:
        return f"<p>{record.number}: {html.escape(str(error))}</p>"
    caption = f"{record.number}: {record.flag or 'registered'}"
    if record.surface is not None:
        caption += f"; {record.surface.median:.3f} mm median, {record.surface.p95:.3f} mm at 95 %"
    return (
        f'<figure><img alt="frame {record.number}" src="{_embedded(pictures)}">'
        f"<figcaption>{html.escape(caption)}</figcaption></figure>"
    )


def _frame_pictures(track: TrackedSequence, record: FrameRecord) -> list[RgbImage]:
    """The scan with its landmarks, and the registered head, from the same viewpoint.

    Raises CaptureError where the scan cannot be read, MachineError without a renderer.
    """
    scan = track.sequence.scan(record.number)
    try:
        scan, _ = checked_scan(scan)
    except CaptureError:
        if record.surface is None:
            raise
    if record.surface is None:
        return [
            _portrait_of_scan(scan, portrait(head_from_arrays("scan", scan.points, scan.triangles)))
        ]
    pose = read_pose(track.path(record.number))
    zero = read_zero(track.path(record.number)).astype(np.float64)
    camera = portrait(track.head)
    level = replace(scan, points=_levelled(track.head, scan.points, pose))
    registered = _levelled(track.head, apply_pose(track.head, zero, pose), pose)
    pictures = [_portrait_of_scan(level, camera), _picture(track.head, registered, camera)]
    try:
        landmarks = track.sequence.landmarks(record.number)
    except CaptureError:
        return pictures
    places = _levelled(track.head, landmarks.points, pose)
    marks = registered[track.head.landmarks] if len(track.head.landmarks) else places
    _draw_points(pictures[0], camera, Landmarks(places, landmarks.confidence).points)
    _draw_points(pictures[1], camera, marks)
    return pictures


def _levelled(head: HeadModel, points: NDArray[np.float64], pose: HeadPose) -> NDArray[np.float64]:
    """Points (point, 3) m as if the head stood upright at its place."""
    pivot = head.joint_positions[0].astype(np.float64)
    rotation = to_matrices(pose.turns[0])
    return (points - pose.translation - pivot) @ rotation + pivot


def _portrait_of_scan(scan: Scan, camera: Camera) -> RgbImage:
    head = head_from_arrays("scan", scan.points, scan.triangles)
    if scan.colors is not None:
        head = replace(head, vertex_color=scan.colors)
    return _picture(head, scan.points, camera)


def _picture(head: HeadModel, points: NDArray[np.float64], camera: Camera) -> RgbImage:
    with open_renderer(head, (SIDE, SIDE), camera=camera) as renderer:
        return renderer.frame(points.astype(np.float32)).copy()


def _draw_points(picture: RgbImage, camera: Camera, points: NDArray[np.float64]) -> None:
    known = points[np.isfinite(points).all(axis=1)]
    if not len(known):
        return
    clip = np.column_stack([known, np.ones(len(known))]) @ camera.matrix(1.0).T
    places = np.stack([1 + clip[:, 0] / clip[:, 3], 1 - clip[:, 1] / clip[:, 3]], axis=1)
    for x, y in (places * SIDE / 2).astype(int):
        if 1 <= x < SIDE - 1 and 1 <= y < SIDE - 1:
            picture[y - 1 : y + 2, x - 1 : x + 2] = (40, 220, 90)


def _embedded(pictures: list[RgbImage]) -> str:
    from PIL import Image

    buffer = io.BytesIO()
    Image.fromarray(np.concatenate(pictures, axis=1)).save(buffer, "JPEG", quality=85)
    return "data:image/jpeg;base64," + base64.b64encode(buffer.getvalue()).decode()
