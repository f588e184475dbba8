"""Projects: a sound, what is known of it, edits and settings, as a file that is rendered alike.

    {"elocute_project": 1, "sound": "line.wav", "text": "…", "phones": null, "edits": [], …}

A project names files beside it by their bare names alone, so a folder is moved or sent as it is,
and a project that came from elsewhere leads to no other place.
"""

from __future__ import annotations

import itertools
import json
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, fields, replace
from difflib import get_close_matches
from pathlib import Path
from typing import TYPE_CHECKING, Any

from elocute.errors import InputError
from elocute.export.registry import WRITERS, check_suffix
from elocute.files.atomic import write_atomically
from elocute.files.json_records import as_record, finite_number, parse_json
from elocute.files.names import checked_name, file_beside
from elocute.files.reading import FileKind, path_of, read_bytes
from elocute.models.take_settings import TakeSettings
from elocute.motion.edits.edit_list import MARK, VERSION, EditList, edits_of
from elocute.one_line_repr import brief, one_line
from elocute.settings import settings_of
from elocute.studio.project_names import SUFFIX

if TYPE_CHECKING:
    from elocute.animation import Animation
    from elocute.models.feature_extraction import Progress
    from elocute.speech.times.labels import Label

PROJECT_MAX_BYTES = 5_000_000
PROJECT_FILE = FileKind(f"a project (NAME{SUFFIX})", PROJECT_MAX_BYTES)
PROJECT_VERSION = 1
TEXT_MAX, LABELS_MAX, TIME_MAX_S = 100_000, 100_000, 1e6
FILES = (".json", ".onnx", ".pkl", ".npz")
"""What a text that names a file ends with, where settings take names and files."""
SETTINGS = tuple(
    each.name for each, _ in settings_of(TakeSettings) if each.name not in ("head", "edits")
)
"""Settings of a take that a project may have; its head is `character`, its edits are `edits`."""
OPTIONS = tuple(dict.fromkeys(name for each in WRITERS.values() for name in each.option_names()))
"""Options of formats that a project may have."""


@dataclass(frozen=True)
class Project:
    """A take that is worked on.

    Parameters
    ----------
    folder : Path
        Where the files lie that it names.
    sound : str
        A sound or a video beside it, by its bare name.
    character : str, optional
        A character or a mesh beside it; None is the built-in head.
    text : str, optional
        What is said.
    language : str, optional
        Its language, as espeak-ng names it; None is the one that is heard, for a text English.
    phones : sequence of (float, float, str), optional
        Start in s, end in s and ARPAbet phone, once somebody has moved or changed one.
    words : sequence of (float, float, str), optional
        Start in s, end in s and word, likewise.
    edits : sequence of mapping
        Items of an edit list.
    settings : mapping
        Of the take: the fields of `TakeSettings`, but for its head and edits.
    options : mapping
        Of outputs: the options of formats, such as `light` and `size`.
    locks : mapping
        What the page keeps beside it.

    Raises
    ------
    InputError
        For a value that cannot be; MotionError for an edit.
    """

    folder: Path
    sound: str
    character: str | None = None
    text: str | None = None
    language: str | None = None
    phones: Sequence[Label] | None = None
    words: Sequence[Label] | None = None
    edits: Sequence[Mapping[str, Any]] = ()
    settings: Mapping[str, Any] = field(default_factory=dict)
    options: Mapping[str, Any] = field(default_factory=dict)
    locks: Mapping[str, Any] = field(default_factory=dict)

    __repr__ = one_line

    def __post_init__(self) -> None:
        checked_name(self.sound, "`sound`")
        if self.character is not None:
            checked_name(self.character, "`character`")
        for name, most in (("text", TEXT_MAX), ("language", 40)):
            value = getattr(self, name)
            if value is not None and not (isinstance(value, str) and len(value) <= most):
                raise InputError.about(
                    f"`{name}`", found=brief(value)[:60], allowed=f"a text of up to {most} letters"
                )
        for name in ("phones", "words"):
            if getattr(self, name) is not None:
                object.__setattr__(self, name, _labels(name, getattr(self, name)))
        for name in ("settings", "options", "locks"):
            _check_object(name, getattr(self, name))
        if not isinstance(self.edits, list | tuple):
            raise InputError.about("`edits`", found=brief(self.edits), allowed="a list of edits")
        object.__setattr__(self, "edits", tuple(self.edits))
        _check_names("setting", self.settings, SETTINGS)
        _check_names("option", self.options, OPTIONS)
        TakeSettings(**self.settings)
        self.edit_list()

    def record(self) -> dict[str, Any]:
        """What its file holds."""
        own = {each.name: getattr(self, each.name) for each in fields(self)[1:]}
        return {"elocute_project": PROJECT_VERSION, **own}

    def text_of_file(self) -> str:
        """Its file."""
        return json.dumps(self.record(), allow_nan=False, indent=1, ensure_ascii=False) + "\n"

    def save(self, path: str | Path) -> str:
        """Write its file, whole or not at all, and give its text. Raises OutputError."""
        text = self.text_of_file()
        with write_atomically(path) as draft:
            draft.write_text(text, encoding="utf-8")
        return text

    def file(self, name: str) -> Path:
        """A file beside the project. Raises InputError where it is not there."""
        return file_beside(self.folder, name)

    def options_of(self, path: Path) -> dict[str, Any]:
        """Its options that the format of an output has. Raises OutputError for no format."""
        names = WRITERS[check_suffix(path)].option_names()
        given = {name: value for name, value in self.options.items() if name in names}
        return {name: tuple(v) if isinstance(v, list) else v for name, v in given.items()}

    def edit_list(self) -> EditList | None:
        """Its edits, None where there are none. Raises MotionError."""
        if not self.edits:
            return None
        items = _beside(self.folder, list(self.edits))
        return edits_of({"elocute": MARK, "version": VERSION, "edits": items})

    def take_settings(self) -> dict[str, Any]:
        """What `animate` takes beside the sound. Raises InputError for a file that is missing."""
        from elocute.speech.known_speech import corrected_phones
        from elocute.speech.times.read import SpeechTimes

        settings = _beside(self.folder, dict(self.settings))
        if self.character is not None:
            settings["head"] = self.file(self.character)
        known: dict[str, Any] = {}
        if self.phones is not None:
            known["phones"] = corrected_phones(self.phones, self._text, self.language or "auto")
        elif self.words is not None:
            known["phones"] = SpeechTimes(words=tuple(self.words))
        elif self._text is not None:
            known["text"] = self._text
        return {
            **settings,
            **known,
            "language": self.language or "auto",
            "edits": self.edit_list(),
        }

    def check(self) -> None:
        """Check that what its settings name is there, as far as that is quick.

        Raises InputError for an unknown model, style, mood, identity or part of life.
        """
        from elocute.head.identity import identity_choice, resolve_identity
        from elocute.life.moods import resolve_mood
        from elocute.life.settings import resolve_life
        from elocute.models.registry import MODELS, open_model

        take = TakeSettings(**_beside(self.folder, dict(self.settings)))
        resolve_life(take.life)
        resolve_mood(take.mood)
        if self.character is None:
            resolve_identity(identity_choice(take.identity))
        if str(take.model) in MODELS or not str(take.model).endswith(FILES):
            open_model(take.model).style(take.style)

    @property
    def _text(self) -> str | None:
        """What is said, None where nothing is."""
        return self.text if self.text is not None and self.text.strip() else None

    def animate(self, progress: Progress | None = None) -> Animation:
        """The take, the same whoever asks for it: page, command line or Python.

        Parameters
        ----------
        progress : callable, optional
            Called with the share that is done, 0 to 1.

        Returns
        -------
        Animation

        Raises
        ------
        InputError
            As `elocute.animate`.
        """
        from elocute.animation import animate
        from elocute.speech.times.read import SpeechTimes

        sound = self.file(self.sound)
        made = animate(sound, progress=progress, **self.take_settings())
        if self.phones is None:
            return made
        times = SpeechTimes(tuple(self.phones), words=tuple(self.words or ()))
        notes = (*made.notes, *times.check(made.motion.duration_s))
        return replace(made, notes=notes, words=times.words)


def open_project(path: str | Path) -> Project:
    """Read a project.

    Parameters
    ----------
    path : str or Path
        A file NAME.elocute.json.

    Returns
    -------
    Project

    Raises
    ------
    InputError
        For anything else, in one line with the file and the fault.
    """
    file = path_of(path)
    return project_of(read_bytes(file, PROJECT_FILE), file.parent, file)


def project_of(data: bytes, folder: Path, subject: str | Path) -> Project:
    """A project from the bytes of its file, which belongs into a folder. Raises InputError."""
    allowed = PROJECT_FILE.allowed
    record = as_record(parse_json(data, subject, allowed=allowed), subject, allowed)
    version = record.pop("elocute_project", None)
    if type(version) is not int or version != PROJECT_VERSION:
        raise InputError.about(
            subject,
            found=f"`elocute_project` {brief(version)}",
            allowed=str(PROJECT_VERSION),
            remedy="a newer Elocute may read it" if isinstance(version, int) else "",
        )
    known = [each.name for each in fields(Project)[1:]]
    for name in record:
        if name not in known:
            near = get_close_matches(name, known, 1)
            raise InputError.about(
                subject,
                found=f"key {brief(name)}",
                allowed=", ".join(known),
                remedy=f"{near[0]!r}?" if near else "",
            )
    if "sound" not in record:
        raise InputError.about(subject, found="no `sound`", allowed="a file beside the project")
    try:
        return Project(folder, **record)
    except InputError as error:
        raise type(error)(f"{subject}: {error}") from None


def _labels(name: str, given: Any) -> tuple[Label, ...]:
    if not isinstance(given, list | tuple) or len(given) > LABELS_MAX:
        raise InputError.about(f"`{name}`", found=brief(given), allowed="a list of up to 100000")
    labels = tuple(_label(f"`{name}`[{place}]", each) for place, each in enumerate(given))
    for before, after in itertools.pairwise(labels):
        if after[0] < before[0]:
            raise InputError.about(
                f"`{name}`",
                found=f"{after[2]!r} at {after[0]:g} s after {before[2]!r} at {before[0]:g} s",
                allowed="rising times",
            )
    if name == "phones":
        from elocute.speech.text.known_phones import checked_phones

        checked_phones([each for each in labels if each[2]])
    return labels


def _label(subject: str, given: Any) -> Label:
    fits = isinstance(given, list | tuple) and len(given) == 3
    start, end = (finite_number(each) for each in given[:2]) if fits else (None, None)
    if (
        start is None
        or end is None
        or not 0 <= start <= end <= TIME_MAX_S
        or not isinstance(given[2], str)
        or len(given[2]) > 200
    ):
        raise InputError.about(subject, found=brief(given), allowed="[start s, end s, name]")
    return start, end, given[2]


def _check_object(name: str, given: Any) -> None:
    if not isinstance(given, Mapping) or not all(isinstance(each, str) for each in given):
        raise InputError.about(f"`{name}`", found=brief(given), allowed="an object")


def _check_names(what: str, given: Mapping[str, Any], known: Sequence[str]) -> None:
    for name in given:
        if name not in known:
            near = get_close_matches(name, known, 1)
            raise InputError.about(
                f"{what} {name[:40]!r}",
                found="unknown",
                allowed=", ".join(known),
                remedy=f"{near[0]!r}?" if near else "",
            )


def _beside(folder: Path, given: Any) -> Any:
    """Values in which each text that names a file is the path of one in a folder.

    Raises InputError for a text that is a path, and for a file that is not there.
    """
    if isinstance(given, Mapping):
        return {name: _beside(folder, value) for name, value in given.items()}
    if isinstance(given, Sequence) and not isinstance(given, str):
        return [_beside(folder, value) for value in given]
    if not isinstance(given, str):
        return given
    if given.lower().rstrip().endswith(FILES) or "/" in given or "\\" in given:
        return str(file_beside(folder, given, brief(given)[:60]))
    return given
