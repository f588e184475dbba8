"""`elocute doctor`: what is installed, and whether every part that the tool needs really works."""

from __future__ import annotations

import importlib.metadata
import json
import platform
import re
import tempfile
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

from elocute.cli import options
from elocute.errors import InputError, MachineError

NEEDED = "pip install --force-reinstall elocute"
PYTHONS = ">=3.11,<3.14"
BROKEN = ("broken", "missing")
_REQUIREMENT = re.compile(
    r"([\w.-]+)\s*(?:\[[^]]*\])?\s*([^;]*?)\s*(?:;.*extra == ['\"](\w+)['\"])?"
)


def doctor_command(as_json: bool = options.Json) -> None:
    """Check the installation: dependencies, sound, video, networks and rendering.

    A short .mp3 and a short .mp4 are written to a temporary folder and read back. The exit code is
    1 where something that Elocute needs is broken; the output says what to do.
    """
    record = dict(_findings())
    if as_json:
        print(json.dumps(record))
    else:
        for name, value in record.items():
            print(f"{name:22} {value}")
    broken = [name for name, value in record.items() if value.startswith(BROKEN)]
    if broken:
        raise MachineError(f"{', '.join(broken)} must be repaired; each line above says how")


def _findings() -> Iterator[tuple[str, str]]:
    from elocute._version import __version__

    yield "elocute", __version__
    python = platform.python_version()
    where = f"on {platform.system()} {platform.machine()}"
    yield "python", f"{python} {where} ({_tested(python, PYTHONS)})"
    yield from _libraries()
    yield from _renderers()
    for name, path in _assets().items():
        there = path.is_file()
        size = f"({path.stat().st_size / 1e6:.1f} MB)" if there else ""
        yield name, f"{path} {size}" if there else f"missing: {path}; {NEEDED}"
    with tempfile.TemporaryDirectory(prefix="elocute-doctor-") as folder:
        for name, check in CHECKS.items():
            yield name, _outcome(check, Path(folder))
    yield "espeak-ng", _espeak()
    yield "recogniser", _recogniser()


def _libraries() -> Iterator[tuple[str, str]]:
    """Every dependency with its version against the tested range; extras where they are."""
    try:
        requirements = importlib.metadata.requires("elocute") or []
    except importlib.metadata.PackageNotFoundError:
        yield "dependencies", "unknown: this elocute runs from its sources, not installed"
        return
    extras: dict[str, tuple[str, list[str]]] = {}
    for text in requirements:
        match = _REQUIREMENT.fullmatch(text)
        if not match:
            continue
        name, allowed, extra = match.groups()
        if extra:
            extras.setdefault(name, (allowed, []))[1].append(extra)
            continue
        version = _version(name)
        missing = f"missing: pip install '{name}{allowed}'"
        yield name, f"{version} ({_tested(version, allowed)})" if version else missing
    for name, (allowed, needed_by) in extras.items():
        version = _version(name)
        absent = f"not installed (extra {', '.join(sorted(set(needed_by)))})"
        yield name, f"{version} ({_tested(version, allowed)})" if version else absent


def _version(name: str) -> str | None:
    try:
        return importlib.metadata.version(name)
    except importlib.metadata.PackageNotFoundError:
        return None


def _tested(version: str, allowed: str) -> str:
    bounds = re.findall(r"(>=|<|==)\s*([\d.]+)", allowed)
    installed = _numbers(version)
    inside = all(
        installed >= _numbers(limit)
        if sign == ">="
        else installed < _numbers(limit)
        if sign == "<"
        else installed == _numbers(limit)
        for sign, limit in bounds
    )
    return f"tested: {allowed}" if inside else f"untested; tested: {allowed}"


def _numbers(version: str) -> tuple[int, ...]:
    """The release of a version, without zeros at its end."""
    release = re.match(r"\d+(\.\d+)*", version)
    numbers = [int(part) for part in release.group().split(".")] if release else []
    while numbers and not numbers[-1]:
        numbers.pop()
    return tuple(numbers)


def _renderers() -> Iterator[tuple[str, str]]:
    try:
        from elocute.render import available_backends

        states = available_backends()
    except ImportError as error:
        yield "renderer", f"broken: {error}; {NEEDED}"
        return
    for name, state in states.items():
        yield f"renderer {name}", state


def _assets() -> dict[str, Path]:
    package = Path(__file__).parents[2]
    return {
        "head": package / "head/assets/head.npz",
        "encoder": package / "encoders/assets/trunk.onnx",
        "viewer": package / "export/assets/viewer.js",
    }


def _espeak() -> str:
    """Whether texts can be spoken, which nothing else needs."""
    from elocute.speech.voices.espeak import speak

    try:
        spoken = speak("Hello.")
    except MachineError as error:
        return f"not there: {error}"
    return f"works ({len(spoken.phones)} phones in {spoken.sound.duration_s:.2f} s)"


def _recogniser() -> str:
    """Whether words can be recognised, which nothing else needs."""
    from elocute.speech.text.recogniser import DEFAULT_RECOGNISER, recogniser_folder

    try:
        return f"{DEFAULT_RECOGNISER}: {recogniser_folder(DEFAULT_RECOGNISER)}"
    except MachineError as error:
        return f"not there: {error}"


def _outcome(check: Callable[[Path], str], folder: Path) -> str:
    """`works (…)`, or what is broken and what to do."""
    try:
        return f"works ({check(folder)})"
    except ModuleNotFoundError as error:
        return f"broken: {error.name} is missing; {NEEDED}"
    except Exception as error:  # a broken library raises anything: that is what is looked for
        message = " ".join(str(error).split()) or type(error).__name__
        return f"broken: {message}; {NEEDED}"


def _tone() -> Any:
    """Half a second of 220 Hz."""
    import numpy as np

    from elocute.audio.waveform import Waveform

    return Waveform((0.1 * np.sin(np.arange(8000) * (2 * np.pi * 220 / 16000))).astype("f4"), 16000)


def _hear(path: Path) -> str:
    """Read a sound file that holds `_tone`; raises InputError where it is not what was written."""
    import numpy as np

    from elocute.audio.read import read_audio

    heard = read_audio(path)
    level = float(np.abs(heard.samples).max(initial=0))
    if not (0.4 < heard.duration_s < 0.7 and 0.05 < level < 0.2):
        raise InputError.about(path.name, found=f"{heard.duration_s:.2f} s at level {level:.2f}")
    return f"{heard.duration_s:.2f} s of sound read"


def _mp3(folder: Path) -> str:
    import soundfile

    tone = _tone()
    soundfile.write(folder / "tone.mp3", tone.samples, tone.sample_rate, format="MP3")
    return _hear(folder / "tone.mp3")


def _encoder(folder: Path) -> str:
    import numpy as np

    from elocute.encoders.registry import resolve_encoder

    values = resolve_encoder("phones")(_tone()).values
    if not np.isfinite(values).all():
        raise InputError.about("the speech encoder", found="numbers that are not finite")
    return f"{values.shape[0]} frames of {values.shape[1]} phones"


def _mp4(folder: Path) -> str:
    """A head that is drawn, encoded with sound, and read again: the picture and the sound."""
    import numpy as np

    from elocute.capture.video.video_frames import Video
    from elocute.export.options import PictureOptions
    from elocute.export.video import write_video
    from elocute.head.builtin import load_builtin_head
    from elocute.motion.motion import Motion

    head, path = load_builtin_head(), folder / "talk.mp4"
    still = Motion(head, np.zeros((5, len(head.expression_names)), np.float32), 10.0)
    write_video(still, path, sound=_tone(), options=PictureOptions(size=(64, 64)))
    with Video(path) as video:
        pictures = [picture for _, picture in video.pictures()]
    if len(pictures) != 5 or pictures[0].shape != (64, 64, 3) or np.ptp(pictures[0]) < 50:
        raise InputError.about(path.name, found=f"{len(pictures)} pictures, none of a head")
    return f"{len(pictures)} pictures drawn and read, {_hear(path)}"


CHECKS: dict[str, Callable[[Path], str]] = {
    "mp3": _mp3,
    "network": _encoder,
    "mp4": _mp4,
}
