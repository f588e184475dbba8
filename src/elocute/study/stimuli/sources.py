"""Where a study's sounds, motion and videos are: files that study.toml names, all in one folder.

What the file names is relative, and stays inside the folder: links that lead out of it are refused
like `..` and absolute paths.
"""

from __future__ import annotations

import re
from dataclasses import replace
from pathlib import Path, PurePosixPath

from elocute.corpus.word_clip import is_inside
from elocute.errors import StudyError
from elocute.study.design.design import ITEMS_MAX, Condition, Design, StimulusSound
from elocute.study.design.design_file import sound_name

VIDEO_SUFFIXES = (".mp4", ".webm", ".mov", ".mkv", ".avi", ".m4v", ".mpg", ".mpeg")
SOUND_SUFFIXES = (".wav", ".flac", ".ogg", ".opus", ".mp3", ".m4a", ".aac", *VIDEO_SUFFIXES)
MOTION_SUFFIXES = (".npz", ".npy")
CORPUS = "corpus.json"
PACKAGE_SOUNDS = "example:"
"""What begins the name of a sound that comes with Elocute: example:example.flac."""


def inside(folder: Path, name: str, about: str) -> Path:
    """The path that study.toml names, relative to a folder, with /.

    Raises StudyError, about what names it, for a path that leads out of the folder.
    """
    path = folder / name
    try:
        within = is_inside(name) and path.resolve().is_relative_to(folder.resolve())
    except (OSError, ValueError, RuntimeError):
        within = False
    if not within:
        raise StudyError.about(
            about,
            found=repr(name)[:120],
            allowed=f"a relative path that stays inside {folder}",
            remedy="`data` names another folder",
        )
    return path


def named_file(folder: Path, value: str, about: str) -> Path | None:
    """The file that a field means which may hold a plain name as well, such as a model or a style.

    A path is what has a folder or a suffix of letters in it; None for a plain name, which the one
    who takes it knows or refuses. Raises StudyError for a path that leads out of the folder.
    """
    is_path = re.search(r"[/\\]|\.[0-9]*[A-Za-z][A-Za-z0-9]*$", value)
    return inside(folder, value, about) if is_path else None


def has_patterns(design: Design) -> bool:
    """Whether any of a design's sounds is a pattern of files, such as `ours/*.mp4`."""
    return any("*" in each.file for each in design.stimuli.sounds)


def with_found_sounds(design: Design, folder: Path) -> Design:
    """The design with a sound for each file that its patterns name, such as `ours/*.mp4`.

    A * stands in the file's name alone. Raises StudyError for a pattern that nothing fits.
    """
    sounds: list[StimulusSound] = []
    for each in design.stimuli.sounds:
        sounds += _matching(each, folder) if "*" in each.file else [each]
    if len(sounds) > ITEMS_MAX:
        raise StudyError.about("[stimuli] `sounds`", found=f"{len(sounds)}", allowed=f"{ITEMS_MAX}")
    return replace(design, stimuli=replace(design.stimuli, sounds=tuple(sounds)))


def _matching(pattern: StimulusSound, folder: Path) -> list[StimulusSound]:
    parent, name = PurePosixPath(pattern.file).parent, PurePosixPath(pattern.file).name
    place = inside(folder, str(parent), "[stimuli] `sounds`") if str(parent) != "." else folder
    files = sorted(each for each in place.glob(name) if each.suffix.lower() in SOUND_SUFFIXES)
    fitting = {_sound_of(each): each for each in reversed(files)}
    if not fitting:
        raise StudyError.about(
            place / name, found="no such sound", allowed=f"files {', '.join(SOUND_SUFFIXES)}"
        )
    return [
        replace(pattern, name=name, file=str(parent / file.name))
        for name, file in sorted(fitting.items())
    ]


def _sound_of(file: Path) -> str:
    """Of the videos one.dana.mp4 and one.esi.mp4 either has the sound `one`."""
    seen = file.suffix.lower() in VIDEO_SUFFIXES
    return sound_name(file.name.partition(".")[0] if seen else file.name)


def sound_file(folder: Path, name: str) -> Path:
    """The file of a sound. Raises StudyError where it is not there."""
    if name.startswith(PACKAGE_SOUNDS):
        folder, name = Path(__file__).parents[2] / "assets", name[len(PACKAGE_SOUNDS) :]
    path = inside(folder, name, "[stimuli] `sounds`")
    if not path.is_file():
        raise StudyError.about(path, found="no such file", allowed="a sound, or a video with one")
    return path


def clip_name(condition: Condition, sound: StimulusSound) -> str:
    """The clip of a corpus, SPEAKER.SENTENCE: of the sound's own speaker or the condition's."""
    name = Path(sound.file).stem
    return f"{condition.speaker}.{name.rpartition('.')[2]}" if condition.speaker else name


def own_sound(folder: Path, condition: Condition, sound: StimulusSound) -> Path | None:
    """The sound of a condition's own speaker, None where it has none. Raises StudyError."""
    if not condition.speaker:
        return None
    place = inside(folder, condition.motion, f"condition {condition.name} `motion`")
    if not (place / CORPUS).is_file():
        raise StudyError.about(
            f"condition {condition.name} `speaker`", found="no corpus", allowed="of a corpus alone"
        )
    from elocute.corpus.corpus_store import open_corpus

    return open_corpus(place).sound_path(clip_name(condition, sound))


def names_of(sound: StimulusSound) -> list[str]:
    """What a file of a sound may be called: the stimulus, or the sound's own file."""
    return list(dict.fromkeys([sound.name, Path(sound.file).stem]))


def motion_file(folder: Path, condition: Condition, sound: StimulusSound, face: str) -> Path:
    """The stored motion of a stimulus; the folder itself where it is a corpus.

    Raises StudyError where there is none.
    """
    place = inside(folder, condition.motion, f"condition {condition.name} `motion`")
    if (place / CORPUS).is_file():
        return place
    names = [f"{name}.{face}" for name in names_of(sound)] + names_of(sound)
    return _first(place, names, MOTION_SUFFIXES, condition, "motion")


def video_file(
    folder: Path, condition: Condition, sound: StimulusSound, face: str, view: str
) -> Path:
    """A video made elsewhere. Raises StudyError where there is none."""
    place = inside(folder, condition.videos, f"condition {condition.name} `videos`")
    names = [f"{name}.{face}.{view}" for name in names_of(sound)]
    names += [f"{name}.{face}" for name in names_of(sound)] + names_of(sound)
    return _first(place, names, VIDEO_SUFFIXES, condition, "videos")


def _first(
    place: Path, names: list[str], suffixes: tuple[str, ...], condition: Condition, field: str
) -> Path:
    for name in names:
        for suffix in suffixes:
            if (place / f"{name}{suffix}").is_file():
                return inside(place, f"{name}{suffix}", f"condition {condition.name} `{field}`")
    raise StudyError.about(
        f"condition {condition.name} `{field}`",
        found=f"no {names[-1]} in {place}",
        allowed=", ".join(f"{name}{suffixes[0]}" for name in names),
    )
