"""`elocute edit`: pose, gaze, blinks, shapes, face and length of a stored motion."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Any

import typer

from elocute.cli import motion_inputs, options
from elocute.cli.format_options import FormatSettings, check_format_settings, options_of_formats
from elocute.cli.keyframes import parse_list, parse_numbers, split_keyframes
from elocute.cli.outputs import nothing_to_do, plan_motion, write_motions
from elocute.errors import InputError
from elocute.files.output_plan import OutputPlan

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from elocute.audio.waveform import Waveform
    from elocute.head.model import HeadModel
    from elocute.motion.edits import EditList
    from elocute.motion.motion import Motion

Edit = Callable[["Motion"], "Motion"]
SOUND_RATE = 48000

_TURN = 'in degrees: "x,y,z", or keyframes "seconds:x,y,z; …"'
_AXES = "+x nods, +y turns to the head's own left, +z tilts to its right."


def edit_command(
    motion: Path = typer.Argument(..., help=motion_inputs.HELP),
    output: list[Path] = options.Output,
    edit_list: Path | None = options.Edits,
    neck: str | None = typer.Option(None, help=f"Turn the neck, {_TURN}. {_AXES}"),
    head_pose: str | None = typer.Option(None, help=f"Turn the head, {_TURN}. {_AXES}"),
    jaw: str | None = typer.Option(
        None, help=f"Turn the jaw beyond what speech does, {_TURN}; +x opens it."
    ),
    eyes: str | None = typer.Option(
        None,
        help='Look in a direction, in degrees: "x,y", or keyframes "seconds:x,y; …". +x looks '
        "down, +y to the head's own left.",
    ),
    shape: list[str] = typer.Option(
        [], help="Set a shape: NAME=weight, or keyframes NAME=seconds:weight; …. Can be repeated."
    ),
    blinks: str | None = typer.Option(None, help='Blink at these times, in seconds: "0.5,2.1".'),
    blink_per_min: float | None = typer.Option(
        None, help="Add random blinks, this many a minute (0 to 120)."
    ),
    replace_blinks: bool = typer.Option(False, help="Remove the blinks that the motion has."),
    seed: int = typer.Option(0, min=0, help="Seed of the random blinks."),
    head: str | None = typer.Option(
        None,
        help="The head's file (a FLAME .pkl), for --identity: a stored motion leaves the "
        "identities of other heads than the built-in one behind. Of curves: the head that moves.",
    ),
    mesh: str | None = options.Mesh,
    flame: Path | None = motion_inputs.FlameModel,
    input_fps: float | None = motion_inputs.InputFps,
    identity: str | None = typer.Option(
        None, help="Change the face: a name, a seed, or a .json file."
    ),
    identity_over_time: str | None = typer.Option(
        None, help='Change the face over time: keyframes "0:ada; 3:ben".'
    ),
    look: str | None = typer.Option(
        None,
        help="Look of the head in pictures and pages: none, a name, a seed, or auto with parts "
        "changed (auto,hair=long). A new --identity brings its own.",
    ),
    start: float | None = typer.Option(
        None, "--from", help="Start of the part to keep, in seconds."
    ),
    stop: float | None = typer.Option(None, "--to", help="End of the part to keep, in seconds."),
    fps: float | None = options.Resampled,
    sound: Path | None = typer.Option(
        None,
        "--sound",
        "--audio",
        help="Sound that belongs to the motion; it is cut along with it.",
    ),
    format_settings: FormatSettings = options_of_formats(),
    overwrite: bool = options.Overwrite,
    no_clobber: bool = options.NoClobber,
    as_json: bool = options.Json,
) -> None:
    """Edit a stored motion: pose, gaze, blinks, shapes, face and length.

    An edit list is applied first, the options after it. All times are those of the input, or of
    what an edit list with new times makes of it.
    """
    stored = motion.suffix.lower() == ".npz" and flame is None
    faces = [identity] if identity else _faces_over_time(identity_over_time)
    if head is not None and not faces and stored:
        raise InputError.about("--head", found="no --identity", allowed="with --identity")
    listed = None if edit_list is None else _listed(edit_list)
    plan = OutputPlan([*faces, *(each for each in (head, edit_list, flame) if each)])
    check_format_settings(output, format_settings)
    for target in output:
        plan_motion(
            plan,
            target,
            motion,
            sound=sound,
            cut=bool(start) or stop is not None,
            format_settings=format_settings,
        )
    if nothing_to_do(plan, overwrite, no_clobber, as_json):
        return
    targets = plan.wanted(output)
    edited = motion_inputs.open_given(
        motion,
        as_json,
        head=None if stored else head,
        mesh=mesh,
        flame=flame,
        input_fps=input_fps,
    )
    if listed is not None:
        from elocute.motion.edits import with_edits

        edited = with_edits(edited, listed)
    space = _identity_space(edited, head) if faces else None
    edits = [
        *_faces(identity, identity_over_time, space),
        *_looks(look, identity, space),
        *(_shape(text) for text in shape),
        *_blinks(blinks, blink_per_min, seed, replace_blinks),
        *_gaze(eyes),
        *_poses({"neck": neck, "head": head_pose, "jaw": jaw}),
        *_sampling(start, stop, fps),
    ]
    duration_s = edited.duration_s
    for edit in edits:
        edited = edit(edited)
    heard = None if sound is None else _heard(sound, start or 0.0, stop, duration_s)
    write_motions(
        plan,
        edited,
        targets,
        sound=heard,
        format_settings=format_settings,
        silence="--audio FILE adds it",
        quiet=as_json,
    )
    if as_json:
        record: dict[str, Any] = {"input": str(motion), "outputs": [str(t) for t in targets]}
        record |= {
            "frames": edited.frame_count,
            "fps": edited.fps,
            "edits": len(edits) + len(listed.items if listed else ()),
        }
        print(json.dumps(record))


def _listed(file: Path) -> EditList:
    from elocute.motion.edits import read_edits

    return read_edits(file)


def _poses(poses: dict[str, str | None]) -> list[Edit]:
    from elocute.motion.edits import with_pose

    edits: list[Edit] = []
    for joint, text in poses.items():
        if text is not None:
            option = "--head-pose" if joint == "head" else f"--{joint}"
            keys = parse_numbers(option, text, 3)
            edits.append(lambda motion, joint=joint, keys=keys: with_pose(motion, joint, keys))
    return edits


def _gaze(text: str | None) -> list[Edit]:
    from elocute.motion.edits import with_gaze

    if text is None:
        return []
    keys = parse_numbers("--eyes", text, 2)
    return [lambda motion: with_gaze(motion, keys)]


def _shape(text: str) -> Edit:
    from elocute.motion.edits import with_shape

    name, equals, weights = text.partition("=")
    if not equals:
        raise InputError.about("--shape", found=repr(text), allowed="NAME=weight")
    keys = parse_numbers(f"--shape {name}", weights, 1)
    return lambda motion: with_shape(motion, name.strip(), keys)


def _blinks(times: str | None, per_minute: float | None, seed: int, instead: bool) -> list[Edit]:
    from elocute.motion.edits import with_blinks

    if times is None and per_minute is None and not instead:
        return []
    moments = [] if times is None else parse_list("--blinks", times)
    return [
        lambda motion: with_blinks(
            motion, moments, per_minute=per_minute or 0.0, seed=seed, replace=instead
        )
    ]


def _faces_over_time(changing: str | None) -> list[str]:
    """The names and files of faces among the keyframes."""
    if changing is None:
        return []
    return [name for _, name in split_keyframes("--identity-over-time", changing)]


def _identity_space(motion: Motion, file: str | None) -> HeadModel | None:
    """The head of a file, in the state in which the motion has it; None for the built-in head."""
    from elocute.adoption.registry import open_speaking_head
    from elocute.head.builtin import load_builtin_head
    from elocute.head.registry import open_head

    if file is not None:
        return open_speaking_head(file) if "jawOpen" in motion.names else open_head(file)
    if motion.head.name == load_builtin_head().name:
        return None
    raise InputError.about(
        f"motion of head {motion.head.name!r}",
        found="its identities did not travel with it",
        allowed="--head FILE, the file that the head was made from",
    )


def _faces(constant: str | None, changing: str | None, space: HeadModel | None) -> list[Edit]:
    from elocute.head.identity import resolve_identity
    from elocute.motion.edits import with_identity_over_time

    if constant is not None and changing is not None:
        raise InputError.about(
            "--identity", found="two faces", allowed="one of --identity and --identity-over-time"
        )
    if constant is not None:
        named = [(0.0, constant)]
    elif changing is not None:
        named = split_keyframes("--identity-over-time", changing)
    else:
        return []
    keys = [(time, resolve_identity(name, space)) for time, name in named]
    longest = max(len(face) for _, face in keys)
    keys = [(time, _filled(face, longest)) for time, face in keys]
    return [lambda motion: with_identity_over_time(motion, keys, space=space)]


def _looks(look: str | None, identity: str | None, space: HeadModel | None) -> list[Edit]:
    from dataclasses import replace

    from elocute.head.looks import identity_look

    if (space is not None and look is None) or (look is None and identity is None):
        return []
    worn = identity_look(look or "auto", identity or "mean")
    return [lambda motion: replace(motion, head=replace(motion.head, look=worn))]


def _filled(face: NDArray[np.float32], count: int) -> NDArray[np.float32]:
    """Coefficients that a file leaves out are zero."""
    import numpy as np

    return np.pad(face, (0, count - len(face)))


def _sampling(start: float | None, stop: float | None, fps: float | None) -> list[Edit]:
    from elocute.motion.edits import cut

    edits: list[Edit] = []
    if start is not None or stop is not None:
        edits.append(lambda motion: cut(motion, start or 0.0, stop))
    if fps is not None:
        edits.append(lambda motion: motion.at_fps(fps))
    return edits


def _heard(sound: Path, start_s: float, stop_s: float | None, end_s: float) -> Path | Waveform:
    """The sound, or the part of it that the kept frames belong to. Raises InputError."""
    from elocute.audio.read import probe_audio, read_audio
    from elocute.audio.waveform import Waveform

    probe_audio(sound)
    if start_s == 0 and stop_s is None:
        return sound
    whole = read_audio(sound, sample_rate=SOUND_RATE)
    stop_s = end_s if stop_s is None else min(stop_s, end_s)
    part = whole.samples[round(start_s * SOUND_RATE) : round(stop_s * SOUND_RATE)]
    if len(part) < 2:
        raise InputError.about(
            sound, found=f"{whole.duration_s:.2f} s of sound", allowed=f"more than {start_s:g} s"
        )
    return Waveform(part, SOUND_RATE)
