"""What worker processes of the studio do: each task is plain values in, plain values out.

A take is a folder of its own in the cache: `take.json`, `weights.f32`, `joints.f32`. Heads and
sounds are shared between takes, by keys that say what they are.
"""

from __future__ import annotations

import hashlib
import json
import os
import warnings
from collections.abc import Callable
from dataclasses import asdict, dataclass, replace
from functools import lru_cache
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np

from elocute.errors import ElocuteError, ElocuteWarning, HeadError, InputError
from elocute.files.atomic import write_atomically
from elocute.files.json_records import as_record, parse_json
from elocute.models.registry import DEFAULT_MODEL
from elocute.models.take_settings import TakeSettings
from elocute.settings import settings_of
from elocute.studio.project import SETTINGS, Project, open_project, project_of

if TYPE_CHECKING:
    from elocute.animation import Animation
    from elocute.head.model import HeadModel
    from elocute.motion.motion import Motion

Tell = Callable[[float], None]
"""Takes the share that is done."""
PEAKS_PER_S = 100
"""Pairs of the waveform's least and greatest sample in a second."""
DURATION_MAX_S = 1200.0
"""Of a sound in the studio; `elocute animate` takes longer ones."""
ANIMATED = 0.8
"""How much of the work on a preview the take itself is."""


@dataclass(frozen=True)
class Task:
    """What a worker is to do: the name of a function of `TASKS`, and what it is given."""

    what: str
    given: dict[str, Any]


def run(task: Task, tell: Tell) -> dict[str, Any]:
    """Do a task; what to know about it is in `notes`. Raises ElocuteError."""
    with warnings.catch_warnings(record=True) as told:
        warnings.simplefilter("ignore")
        warnings.simplefilter("always", ElocuteWarning)
        result = TASKS[task.what](tell=tell, **task.given)
    notes = [str(each.message) for each in told]
    return {**result, "notes": list(dict.fromkeys([*result.get("notes", ()), *notes]))}


def warm(tell: Tell, *, cache: str) -> dict[str, Any]:
    """Load what the first take needs, and make its head, before it is asked for."""
    from elocute.animation import animate

    tell(0.1)
    motion = animate(np.zeros(16000, np.float32), rate=16000).motion
    path = Path(cache) / "heads" / f"{_head_key(motion.head)}.glb"
    _write_head(motion, Project(Path(cache), "silence.wav"), path)
    return {}


def about(tell: Tell, *, recogniser: str) -> dict[str, Any]:
    """What a take may be made of: models with their styles, moods, faces, looks, settings."""
    from elocute.encoders.phones_and_visemes import PHONES
    from elocute.export.registry import WRITERS
    from elocute.head.identity import identity_names
    from elocute.head.looks.people import PEOPLE
    from elocute.head.viseme_shapes import VISEME_SHAPES
    from elocute.life.moods import MOODS
    from elocute.meshes.gltf_document import SUFFIXES as CHARACTER_SUFFIXES
    from elocute.models.registry import MODELS, open_model
    from elocute.motion.curves import ARKIT_NAMES
    from elocute.motion.edits.edit_list import KINDS
    from elocute.render.lights import RIGS

    tell(0.0)
    models = {
        name: {"about": each.about, "styles": list(open_model(name).styles)}
        for name, each in MODELS.items()
    }
    return {
        "models": models,
        "styles": models[DEFAULT_MODEL]["styles"],
        "moods": list(MOODS),
        "identities": list(identity_names()),
        "looks": ["auto", "none", *PEOPLE],
        "lights": list(RIGS),
        "formats": {
            suffix.lstrip("."): _described(each.options) for suffix, each in WRITERS.items()
        },
        "settings": [one for one in _described(TakeSettings) if one["name"] in SETTINGS],
        "edits": {kind: list(keys) for kind, (keys, _) in KINDS.items()},
        "phones": list(PHONES),
        "characters": list(CHARACTER_SUFFIXES),
        "shapes": [*ARKIT_NAMES, *(f"viseme_{each}" for each in VISEME_SHAPES if each != "W")],
        "extras": {
            "transcribe": _works(lambda: _recogniser(recogniser)),
            "speech": _works(_voice),
        },
    }


def _described(cls: type | None) -> list[dict[str, Any]]:
    """Settings of a dataclass as a page shows them."""
    return (
        []
        if cls is None
        else [
            {
                "name": each.name,
                "default": each.default,
                "type": str(each.type),
                "help": known.help,
                "unit": known.unit,
                "low": known.low,
                "high": known.high,
                "choices": list(known.choices),
            }
            for each, known in settings_of(cls)
        ]
    )


def _works(open_it: Callable[[], object]) -> bool:
    """Whether something is installed here."""
    try:
        open_it()
    except ElocuteError:
        return False
    return True


def _recogniser(name: str) -> None:
    from elocute.speech.text.recogniser import recogniser_folder

    recogniser_folder(name)


def _voice() -> None:
    from elocute.speech.voices.registry import speak

    speak("a")


def probe(tell: Tell, *, path: str, name: str) -> dict[str, Any]:
    """What a sound or a video is. Raises AudioError, about its name, for anything else."""
    from elocute.audio.read import open_audio, probe_audio

    tell(0.0)
    try:
        record = asdict(probe_audio(path))
        with open_audio(Path(path)) as stream:
            count = 0
            for block in stream.blocks():
                count += len(block)
                _check_duration(name, count / stream.sample_rate)
    except InputError as error:
        raise type(error)(str(error).replace(path, name)) from None
    return {"duration_s": count / stream.sample_rate, "tracks": record["tracks"]}


def speak_text(tell: Tell, *, text: str, path: str, language: str = "en-us") -> dict[str, Any]:
    """Speak a text into a .wav; its phones and words with their times. Raises InputError,
    MachineError."""
    from elocute.export.soundtrack import write_wav
    from elocute.speech.voices.registry import speak
    from elocute.speech.voices.settings import VoiceSettings

    tell(0.0)
    spoken = speak(text, VoiceSettings(language))
    _check_duration("text", spoken.sound.duration_s)
    with write_atomically(path) as draft:
        write_wav(spoken.sound, draft)
    words = [(w.phones[0][0], w.phones[-1][1], w.text) for w in spoken.words if w.phones]
    return {"phones": list(spoken.phones), "words": words}


def transcribe(tell: Tell, *, project: str, recogniser: str) -> dict[str, Any]:
    """The words of a project's sound, "" where none are recognised that fit it.

    Raises MachineError without a model that recognises words.
    """
    from elocute.errors import AlignmentError
    from elocute.speech.text.recogniser import recognise
    from elocute.speech.timed_phones import find_phones

    opened = open_project(project)
    sound = opened.file(opened.sound)
    seconds = _duration_s(sound)
    language = opened.language or "auto"
    heard = recognise(
        sound, recogniser, language, None, lambda done: tell(min(1.0, done / seconds))
    )
    text, notes = heard.text.strip(), list(heard.notes)
    try:
        if text:
            find_phones(sound, text=text, language=language)
    except AlignmentError as error:
        text, notes = "", [*notes, f"words recognised that do not fit the sound ({error})"]
    return {"text": text, "notes": notes}


def names(tell: Tell, *, path: str, name: str, given: str) -> dict[str, Any]:
    """Write what is said of a character's shapes beside it; how it is understood then.

    Raises HeadError for what cannot be meant, and keeps nothing of it.
    """
    from elocute.adoption.characters.given_names import NAMES_KIND, given_names, names_path

    subject, allowed = names_path(Path(name)).name, NAMES_KIND.allowed
    record = as_record(
        parse_json(given, subject, allowed=allowed, error=HeadError), subject, allowed, HeadError
    )
    given_names(record, subject)
    with write_atomically(names_path(Path(path))) as draft:
        draft.write_text(f"{json.dumps(record, indent=1, ensure_ascii=False)}\n", encoding="utf-8")
    return character(tell, path=path, name=name)


def character(tell: Tell, *, path: str, name: str) -> dict[str, Any]:
    """How a character is understood, as `elocute info` tells it; `names`: what is said of its
    shapes. Raises HeadError; one of unknown names is told of them."""
    from elocute.adoption.characters.given_names import stored_names
    from elocute.adoption.characters.open_character import UnknownShapesError, open_character
    from elocute.adoption.characters.report import FITTED, character_record
    from elocute.adoption.characters.shape_names import nearest_name
    from elocute.adoption.registry import is_scan, open_speaking_head

    tell(0.0)
    told: dict[str, Any] = {"mapped": {}, "fitted": {}, "idle": {}, "unknown": {}, "names": {}}
    try:
        if is_scan(Path(path)):
            open_speaking_head(path)  # raises where there is no face
            return {**told, "notes": ["no shapes of its own: a face is fitted to its mesh"]}
        told["names"] = stored_names(Path(path))
        record = character_record(open_character(Path(path)))
    except InputError as error:
        if isinstance(error, UnknownShapesError) and error.names:
            told["unknown"] = {each: nearest_name(each) or "" for each in error.names}
            return {**told, "notes": ["no shapes of a mouth are known: say what they do"]}
        raise type(error)(str(error).replace(path, name)) from None
    mapped = record["mapped"]
    fitted = {each: takes for each, takes in mapped.items() if takes.startswith(FITTED)}
    return {
        **told,
        **record,
        "mapped": {each: takes for each, takes in mapped.items() if each not in fitted},
        "fitted": fitted,
        "warnings": record["notes"],
    }


def export(tell: Tell, *, project: str, target: str, options: dict[str, Any]) -> dict[str, Any]:
    """Write a take beside its project, as `elocute render` does. Raises ElocuteError."""
    from elocute.export.registry import side_files
    from elocute.files.output_plan import OutputPlan

    opened, path = open_project(project), Path(target)
    given = opened.options_of(path) | options
    sound = opened.file(opened.sound)
    plan = OutputPlan(remedy="rename it, or export under another name")
    plan.add(path, Path(project))
    for side in side_files(path, sound, given):
        plan.add(side, sound, beside=path)
    plan.check()
    animation = opened.animate(lambda share: tell(0.3 * share))
    with plan.writing(path):
        animation.write(
            path, overwrite=True, progress=lambda share: tell(0.3 + 0.7 * share), **given
        )
    return {"file": path.name, "notes": list(animation.notes)}


def preview(
    tell: Tell, *, project: dict[str, Any] | str, folder: str, cache: str, digest: str
) -> dict[str, Any]:
    """Compute a take for the page into the cache. Raises ElocuteError."""
    opened = _given(project, Path(folder))
    room = Path(cache)
    take = room / "takes" / digest
    if (there := _there_already(room, take)) is not None:
        return there
    sound = opened.file(opened.sound)
    _check_duration(opened.sound, _duration_s(sound))
    animation = opened.animate(lambda share: tell(ANIMATED * share))
    heard = _phones(opened, animation)
    tell(0.9)
    motion = animation.motion
    seen, told = _seen(motion)
    head_key = _head_key(seen.head)
    _write_head(seen, opened, room / "heads" / f"{head_key}.glb")
    sound_key = _sound_key(sound)
    _write_sound(sound, room / "sounds" / sound_key)
    take.mkdir(parents=True, exist_ok=True)
    moves = _write_frames(motion, seen, take)
    own = motion.head.character
    record = {
        "digest": digest,
        "fps": motion.fps,
        "frames": motion.frame_count,
        "duration_s": motion.duration_s,
        "shapes": list(motion.names),
        "joints": list(seen.head.joint_names),
        "phones": heard["phones"],
        "words": [list(each) for each in animation.words] or heard["words"],
        "contacts": _contacts(motion),
        "head_key": head_key,
        "head_url": f"/api/heads/{head_key}.glb",
        "stage_url": f"/api/heads/{head_key}.json",
        "weights_url": f"/api/takes/{digest}/weights",
        "moves_url": f"/api/takes/{digest}/{moves}",
        "joints_url": f"/api/takes/{digest}/joints",
        "sound_url": f"/api/sounds/{sound_key}",
        "peaks_url": f"/api/sounds/{sound_key}/peaks",
        "character": None if own is None else own.name,
        "notes": list(dict.fromkeys([*animation.notes, *heard["notes"], *told])),
    }
    _write_json(take / "take.json", record)
    return {"take": digest, "notes": record["notes"]}


def stage(
    tell: Tell, *, project: dict[str, Any] | str, folder: str, path: str, light: str
) -> dict[str, Any]:
    """What the page is told of a head's light and views, into a file."""
    from elocute.export.html import viewer_stage, viewer_views

    tell(0.0)
    head = _still(_given(project, Path(folder)))
    told = {"stage": viewer_stage(head, light), **viewer_views(head)}
    _write_json(Path(path), told | {"joints": list(head.joint_names)})
    return {}


TASKS: dict[str, Callable[..., dict[str, Any]]] = {
    each.__name__: each
    for each in (
        about,
        warm,
        probe,
        speak_text,
        transcribe,
        character,
        names,
        export,
        preview,
        stage,
    )
}


def _there_already(room: Path, take: Path) -> dict[str, Any] | None:
    """The result of a take that the cache holds with all that belongs to it; it is young again."""
    try:
        record = json.loads((take / "take.json").read_text("utf-8"))
        sound = room / "sounds" / record["sound_url"].rpartition("/")[2]
        for each in (take, sound, room / "heads" / f"{record['head_key']}.glb"):
            os.utime(each)
    except OSError:
        return None
    return {"take": record["digest"], "notes": record["notes"]}


def _given(project: dict[str, Any] | str, folder: Path) -> Project:
    """A project as it is saved, or as the page has it."""
    if isinstance(project, str):
        return open_project(project)
    return project_of(json.dumps(project).encode(), folder, "project")


def _still(project: Project) -> HeadModel:
    """The head of a project's takes, as it is drawn."""
    from elocute.animation import animate

    taken = project.take_settings()
    for name in ("phones", "text", "language", "edits"):
        taken.pop(name, None)
    motion = animate(np.zeros(1600, np.float32), rate=16000, **taken).motion
    return _seen(motion)[0].head


def _seen(motion: Motion) -> tuple[Motion, list[str]]:
    """The motion as it is drawn, of a character with the shapes of its own file; and what is to be
    known of that. Where its file cannot be drawn, the built-in head stands for it.
    """
    from elocute.export.drawn_character import drawn

    with warnings.catch_warnings(record=True) as caught:
        warnings.simplefilter("always")
        try:
            seen = drawn(motion)
        except HeadError as error:
            return motion.dressed(), [f"the built-in head is shown: {error}"]
    return seen, [str(each.message) for each in caught if each.category is ElocuteWarning]


def _head_key(head: HeadModel) -> str:
    told = f"{head.name} {head.look!r} {head.expression_names} {head.joint_names}"
    inside = hashlib.sha256(told.encode())
    inside.update(np.ascontiguousarray(head.template).data)
    for surface in head.surfaces.values():
        inside.update(surface.color or b"")
    return inside.hexdigest()[:24]


def _write_head(motion: Motion, project: Project, path: Path) -> None:
    """The head alone, as the viewer wants it, and what it is made from, unless it is there."""
    from elocute.export.gltf import glb_bytes
    from elocute.export.options import GlbOptions

    if path.is_file():
        return
    turns = motion.rotations
    one = replace(
        motion,
        weights=np.zeros_like(motion.weights[:1]),
        rotations=None if turns is None else turns[:1],
    )
    data = glb_bytes(one, options=GlbOptions(profile="elocute"), for_viewer=True)
    path.parent.mkdir(parents=True, exist_ok=True)
    plain = replace(project, phones=None, words=None, edits=())
    _write_json(path.with_suffix(".recipe"), plain.record())
    with write_atomically(path) as draft:
        draft.write_bytes(data)


def _write_frames(motion: Motion, seen: Motion, folder: Path) -> str:
    """Weights of the curves; weights and turns as the .glb of the head has them: (frame, shape),
    (frame, joint, 4) xyzw. The name of the file that has the second weights."""
    from elocute.export.gltf_file import unit_xyzw
    from elocute.numerics.quaternions import no_turn

    joints = len(seen.head.joint_names)
    turns = seen.rotations
    if turns is None:
        turns = no_turn(seen.frame_count, joints)
    frames = {
        "weights": motion.weights,
        "joints": unit_xyzw(turns.reshape(-1, 4)).reshape(-1, joints, 4) if joints else turns,
    }
    is_same = seen.names == motion.names and np.array_equal(seen.weights, motion.weights)
    if not is_same:
        frames["moves"] = seen.weights
    for name, values in frames.items():
        with write_atomically(folder / f"{name}.f32") as draft:
            draft.write_bytes(np.ascontiguousarray(values, "<f4").tobytes())
    return "weights" if is_same else "moves"


def _sound_key(sound: Path) -> str:
    facts = sound.stat()
    told = f"{sound.absolute()} {facts.st_size} {facts.st_mtime_ns}"
    return hashlib.sha256(told.encode()).hexdigest()[:24]


def _write_sound(sound: Path, folder: Path) -> None:
    """The sound as every browser plays it, and its peaks, unless they are there."""
    from elocute.export.soundtrack import pack_sound, sound_blocks

    if (folder / "peaks.json").is_file():
        return
    folder.mkdir(parents=True, exist_ok=True)
    packed, media = pack_sound(sound)
    with write_atomically(folder / "sound") as draft:
        draft.write_bytes(packed)
    samples = np.concatenate(list(sound_blocks(sound, 16000)))
    width = 16000 // PEAKS_PER_S
    padded = np.pad(samples, (0, -len(samples) % width)).reshape(-1, width)
    _write_json(
        folder / "peaks.json",
        {
            "per_second": PEAKS_PER_S,
            "media": media,
            "min": np.round(padded.min(axis=1).astype(float), 3).tolist(),
            "max": np.round(padded.max(axis=1).astype(float), 3).tolist(),
        },
    )


def _phones(project: Project, animation: Animation) -> dict[str, Any]:
    """Phones and words to be shown: the project's own, else those that are found."""
    if project.phones is not None:
        return {"phones": project.phones, "words": project.words or (), "notes": ()}
    sound = project.file(project.sound)
    return _found(sound, _sound_key(sound), project.text, project.language or "auto", project.words)


@lru_cache(maxsize=32)
def _found(sound: Path, key: str, text: str | None, language: str, words: Any) -> dict[str, Any]:
    from elocute.speech.timed_phones import find_phones
    from elocute.speech.times.read import SpeechTimes

    known: dict[str, Any] = {}
    if words is not None:
        known["times"] = SpeechTimes(words=words)
    elif text is not None and text.strip():
        known["text"] = text
    speech = find_phones(sound, language=language, **known)
    return {"phones": speech.phones, "words": speech.words, "notes": speech.notes}


def _contacts(motion: Motion) -> list[tuple[float, float]]:
    """Start and end in s of each time that lips are sealed."""
    from elocute.articulation.contacts_and_rest import runs
    from elocute.motion.edits.closures import sealed_frames

    return [(start / motion.fps, end / motion.fps) for start, end in runs(sealed_frames(motion))]


def _duration_s(sound: Path) -> float:
    from elocute.export.soundtrack import sound_duration_s

    return sound_duration_s(sound) or DURATION_MAX_S


def _check_duration(name: str, seconds: float) -> None:
    if seconds > DURATION_MAX_S:
        raise InputError.about(
            name,
            found=f"{seconds:.0f} s or more",
            allowed=f"up to {DURATION_MAX_S:.0f} s in the studio",
            remedy="cut it, or use `elocute animate`",
        )


def _write_json(path: Path, record: dict[str, Any]) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    with write_atomically(path) as draft:
        draft.write_text(json.dumps(record, allow_nan=False), encoding="utf-8")
