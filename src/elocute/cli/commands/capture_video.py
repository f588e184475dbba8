"""`elocute capture video`: a person talking in a video, as motion of the built-in head."""

from __future__ import annotations

import json
import time
from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from elocute.cli import options
from elocute.cli.format_options import FormatSettings, check_format_settings, options_of_formats
from elocute.cli.outputs import nothing_to_do, plan_motion, write_motions
from elocute.cli.progress import progress_bar
from elocute.errors import CaptureError, OutputError
from elocute.files.output_plan import OutputPlan
from elocute.numerics.frame_rates import frame_rate

if TYPE_CHECKING:
    from elocute.capture.video.video_to_motion import VideoCapture
    from elocute.motion.motion import Motion

OWN = "own"


def video_command(
    video: list[Path] = typer.Argument(
        ..., help="Video of a person talking; several for a corpus."
    ),
    output: list[Path] = options.Output,
    face: str | None = typer.Option(
        None, help="Face to follow of several: left, right, or its number from the left."
    ),
    fps: float | None = typer.Option(
        None,
        help="Frames per second; by default the video's own, or 60 for a corpus.",
        parser=frame_rate,
        metavar="RATE",
    ),
    identity: str = typer.Option(
        OWN, help="Identity of the face: own (the person's), a name, a seed, or a .json file."
    ),
    zero_pose: bool = typer.Option(False, help="Leave out all turns of head, jaw and eyes."),
    subject: str = typer.Option("me", help="Name of the person in a corpus."),
    text: str = typer.Option("", help="Text that is said, for a corpus of one clip."),
    format_settings: FormatSettings = options_of_formats(),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Capture a face from video: as a motion in any format, or as clips of a corpus (-o FOLDER)."""
    corpora = [path for path in output if not path.suffix]
    files = [path for path in output if path.suffix]
    plan = _plan(video, files, corpora, identity, format_settings)
    if nothing_to_do(plan, overwrite, no_clobber, as_json):
        return
    for place in plan.wanted(corpora):
        with plan.writing(place):
            _write_corpus(place, video, face, fps, subject, text, as_json)
    files = plan.wanted(files)
    if not files:
        return
    started = time.perf_counter()
    captured = _capture(video[0], face, fps, as_json)
    seconds = time.perf_counter() - started
    motion = _dressed(captured.motion, identity, zero_pose)
    sound = video[0] if captured.track.has_sound else None
    write_motions(
        plan,
        motion,
        files,
        sound=sound,
        format_settings=format_settings,
        silence=f"{video[0].name} has none",
        quiet=as_json,
    )
    _report(video[0], captured, files, seconds, as_json)


def _plan(
    videos: list[Path],
    files: list[Path],
    corpora: list[Path],
    identity: str,
    format_settings: FormatSettings,
) -> OutputPlan:
    """All outputs. Raises InputError."""
    if files and len(videos) > 1:
        raise OutputError.about(
            files[0],
            found=f"one file for {len(videos)} videos",
            allowed="a corpus folder",
            remedy="give one video at a time",
        )
    plan = OutputPlan([identity])
    check_format_settings(files, format_settings)
    for target in files:
        plan_motion(plan, target, videos[0], sound=videos[0], format_settings=format_settings)
    for place in corpora:
        plan.add(place, *videos)
    return plan


def _capture(path: Path, face: str | None, fps: float | None, quiet: bool) -> VideoCapture:
    from elocute.capture.video.video_to_motion import capture_video

    with progress_bar(f"tracking {path.name}", quiet) as progress:
        return capture_video(path, face=face, fps=fps, progress=progress)


def _dressed(motion: Motion, identity: str, zero_pose: bool) -> Motion:
    """The motion on the face asked for, with joint rotations or without."""
    from elocute.head.looks import person

    if identity != OWN:
        motion = replace(motion, head=person(identity))
    return replace(motion, rotations=None) if zero_pose else motion


def _write_corpus(
    place: Path,
    videos: list[Path],
    face: str | None,
    fps: float | None,
    subject: str,
    text: str,
    as_json: bool,
) -> None:
    from elocute.capture.video_to_corpus import FPS, write_video_corpus

    if text and len(videos) > 1:
        raise CaptureError.about("--text", found=f"{len(videos)} videos", allowed="one video")

    def captures() -> Iterator[tuple[Path, VideoCapture]]:
        for path in videos:
            yield path, _capture(path, face, None, as_json)

    texts = {videos[0].stem: text}
    notes = write_video_corpus(place, captures(), subject=subject, fps=fps or FPS, texts=texts)
    if as_json:
        print(json.dumps({"output": str(place), "clips": len(videos), "notes": notes}))
        return
    print(place)
    for note in notes:
        print(note)


def _report(
    path: Path, captured: VideoCapture, files: list[Path], seconds: float, as_json: bool
) -> None:
    motion = captured.motion
    if not as_json:
        for note in captured.notes:
            print(note)
        print(f"mean error of the lips: {captured.lip_miss:.1%} of the distance between the eyes")
        return
    record: dict[str, Any] = {
        "input": str(path),
        "outputs": [str(target) for target in files],
        "frames": motion.frame_count,
        "fps": motion.fps,
        "capture_s": round(seconds, 3),
        "lip_miss": round(captured.lip_miss, 5),
        "flagged": captured.flagged.nonzero()[0].tolist(),
        "identity": [round(float(x), 4) for x in captured.person.identity],
        "notes": list(captured.notes),
    }
    print(json.dumps(record))
