"""`study new`: every video of a study, made once; a run that was cut off goes on where it was."""

from __future__ import annotations

import contextlib
import hashlib
import json
import shutil
from collections.abc import Callable, Iterator
from dataclasses import asdict, dataclass, replace
from pathlib import Path

import numpy as np

from elocute._version import __version__
from elocute.array_types import Float32Array, Float64Array
from elocute.audio.waveform import Waveform
from elocute.errors import OutputError, StudyError
from elocute.files.atomic import write_atomically
from elocute.files.reading import file_sha256
from elocute.jobs.pool import FailedTask, Pool, one_after_another
from elocute.study.design.design import MISMATCHED, Design
from elocute.study.design.design_file import read_design
from elocute.study.design.trials import Clip, Pair, all_videos, other_stimulus
from elocute.study.stimuli.clip_file import write_clip
from elocute.study.stimuli.manifest import (
    DESIGN,
    PAIRS,
    VIDEOS,
    Manifest,
    Video,
    read_manifest,
)
from elocute.study.stimuli.sources import own_sound, sound_file, with_found_sounds
from elocute.study.stimuli.stimulus_pictures import PictureSource, clip_pictures, source_files
from elocute.study.stimuli.stimulus_sound import heard, read_part

RECIPE = 2
"""Raised where the same sources would make other videos."""
LUMA_DIFFERS = 8.0
"""Of 255: a difference of brightness between clips that are compared, and that people may see."""
ANSWERS = "answers.db"


def pad_s(design: Design) -> float:
    """Rest before and after every clip, s, so that a sound that is moved stays whole."""
    return max(abs(each.offset_ms) for each in design.conditions) / 1000


class ClipMaking:
    """What one clip is made from."""

    def __init__(self, design: Design, data: Path, clip: Clip) -> None:
        name, self.face, self.view = clip.stimulus.split(".")
        self.design, self.data, self.clip = design, data, clip
        named = design.obvious if clip.condition == MISMATCHED else clip.condition
        self.condition = design.condition(named)
        sounds = {each.name: each for each in design.stimuli.sounds}
        self.sound = sounds[name]
        self.mismatched = clip.condition == MISMATCHED or self.condition.mismatched
        other = other_stimulus(design, clip.stimulus).partition(".")[0]
        self.moving = sounds[other] if self.mismatched else self.sound
        own = own_sound(data, self.condition, self.sound)
        self.own = own is not None
        self.heard_file = own or sound_file(data, self.sound.file)
        if self.mismatched:
            self.seen_file = sound_file(data, self.moving.seen or self.moving.file)
        elif self.sound.seen:
            self.seen_file = sound_file(data, self.sound.seen)
        else:
            self.seen_file = self.heard_file

    @property
    def source(self) -> PictureSource:
        """What its pictures are made from, its voice not read yet."""
        moving = self.moving
        if moving.seen and not self.mismatched:
            moving = replace(moving, file=moving.seen, name=self.sound.name)
        none = Waveform(np.zeros(2, np.float32), 16_000)
        return PictureSource(
            self.condition, self.design.stimuli, moving, none, self.face, self.view, self.data
        )

    def voice(self) -> Waveform:
        """What is heard."""
        sound = self.sound
        part = (0.0, 0.0) if self.own else (sound.start_s, sound.end_s)
        return read_part(self.heard_file, *part)

    def moving_voice(self, voice: Waveform) -> Waveform:
        """What the face moves to."""
        if self.seen_file == self.heard_file and self.moving is self.sound:
            return voice
        whole = bool(self.moving.seen)
        part = (0.0, 0.0) if whole else (self.moving.start_s, self.moving.end_s)
        return read_part(self.seen_file, *part)

    def times(self, seconds: float) -> Float64Array:
        """The moment of the motion in each frame, s."""
        fps = self.design.stimuli.fps
        # To the nearest frame: coders lengthen a sound by some milliseconds of silence.
        frames = np.arange(max(1, round(seconds * fps))) / fps
        # A sound that is later than its picture is a picture that is ahead of its sound.
        moments = frames - pad_s(self.design) + self.condition.offset_ms / 1000
        return np.asarray(moments, np.float64)


@dataclass(frozen=True)
class Made:
    """What `make_stimuli` did."""

    manifest: Manifest  # all videos
    # Videos made now, and those that were there.
    rendered: int
    kept: int


@dataclass(frozen=True)
class _Task:
    """One video to be made; everything that a process needs for it."""

    video: Clip | Pair
    design: Design
    data: Path
    folder: Path
    key: str

    @property
    def file(self) -> str:
        kind = PAIRS if isinstance(self.video, Pair) else VIDEOS
        return f"{kind}/{self.video.name}.mp4"


def make_stimuli(
    path: Path,
    folder: Path,
    *,
    data: Path | None = None,
    pool: Pool = one_after_another,
    progress: Callable[[float], None] | None = None,
) -> Made:
    """Make the folder of a study, or complete one that was begun.

    Names in study.toml begin at `data`, by default the file's folder; `progress` is called with the
    share done, 0 to 1. Raises StudyError for a study that cannot be made, and for a folder with
    answers to another study, OutputError for a folder that cannot be written or holds something
    else.
    """
    begins = path.parent if data is None else data
    design = with_found_sounds(read_design(path), begins)
    _prepare(folder, path, design)
    clips, pairs = all_videos(design)
    before = _before(folder)
    known = dict(before.videos) if before else {}
    keys = _keys(design, begins, clips, pairs)
    tasks = [_Task(each, design, begins, folder, keys[each.name]) for each in [*clips, *pairs]]
    whole = {
        task.video.name for task in tasks if _is_made(folder, known.get(task.video.name), task)
    }
    videos = {name: known[name] for name in sorted(whole)}
    manifest = Manifest(design.sha256, design.stimuli.sounds, videos)
    manifest.write(folder)
    missing = [task for task in tasks if task.video.name not in whole]
    done = len(whole)
    for kind in (Clip, Pair):  # pairs are made of clips
        for task, result in pool(_make, [each for each in missing if isinstance(each.video, kind)]):
            if isinstance(result, FailedTask):
                raise StudyError(f"{task.video.name}: {result.reason}")
            manifest = replace(manifest, videos={**manifest.videos, result.name: result})
            manifest.write(folder)
            done += 1
            if progress:
                progress(done / len(tasks))
    manifest = replace(manifest, notes=tuple(_notes(manifest, pairs)))
    manifest.write(folder)
    _remove_others(folder, manifest)
    return Made(manifest, len(missing), len(whole))


def _prepare(folder: Path, path: Path, design: Design) -> None:
    """Make the folder, with the study's file in it. Raises StudyError, OutputError."""
    copy = folder / DESIGN
    if folder.exists() and not folder.is_dir():
        raise OutputError.about(folder, found="a file", allowed="a folder")
    if folder.is_dir() and any(folder.iterdir()) and not copy.is_file():
        raise OutputError.about(
            folder, found="a folder with other files in it", allowed="a new or empty folder"
        )
    changed = not copy.is_file() or file_sha256(copy, StudyError) != design.sha256
    if changed and (folder / ANSWERS).exists():
        raise StudyError.about(
            folder,
            found="answers to another study than this file's",
            allowed="a new folder",
            remedy="what people answered to stays as it was",
        )
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise OutputError.about(folder, found=f"cannot be made ({error.strerror})") from error
    if changed:
        with write_atomically(copy) as draft:
            shutil.copyfile(path, draft)


def _before(folder: Path) -> Manifest | None:
    with contextlib.suppress(StudyError):
        return read_manifest(folder)
    return None


def _is_made(folder: Path, video: Video | None, task: _Task) -> bool:
    if video is None or video.key != task.key or video.file != task.file:
        return False
    path = folder / video.file
    if not path.is_file() or path.stat().st_size != video.size:
        return False
    return file_sha256(path, StudyError) == video.sha256


def _keys(design: Design, data: Path, clips: list[Clip], pairs: list[Pair]) -> dict[str, str]:
    """A digest of all that each video is made from: files by content. Raises StudyError."""
    digests: dict[Path, str] = {}

    def digest(path: Path) -> str:
        if path not in digests:
            digests[path] = file_sha256(path, StudyError)
        return digests[path]

    keys = {}
    common = {
        "recipe": [RECIPE, __version__],
        "stimuli": {k: v for k, v in asdict(design.stimuli).items() if k in _SHARED},
        "pad_s": pad_s(design),
        "seed": design.study.seed,
    }
    for clip in clips:
        making = ClipMaking(design, data, clip)
        files = [making.heard_file, making.seen_file, *source_files(making.source)]
        recipe = {
            **common,
            "clip": clip.name,
            "condition": asdict(making.condition),
            "sounds": [asdict(making.sound), asdict(making.moving)],
            "files": [digest(each) for each in files],
        }
        keys[clip.name] = hashlib.sha256(json.dumps(recipe, sort_keys=True).encode()).hexdigest()
    for pair in pairs:
        recipe = "+".join(keys[clip.name] for clip in pair.clips)
        keys[pair.name] = hashlib.sha256(recipe.encode()).hexdigest()
    return keys


_SHARED = ("size", "fps", "light", "background", "look", "loudness_db")


def _make(task: _Task) -> Video:
    """Make one video; what a worker does. Raises InputError."""
    return _make_pair(task) if isinstance(task.video, Pair) else _make_clip(task)


def _make_clip(task: _Task) -> Video:
    assert isinstance(task.video, Clip)
    making = ClipMaking(task.design, task.data, task.video)
    voice = making.voice()
    pad = pad_s(task.design)
    seconds = voice.duration_s + 2 * pad
    times = making.times(seconds)
    source = replace(making.source, voice=making.moving_voice(voice))
    path = _place(task)
    sound = _heard(task.design, making, voice, len(times) / task.design.stimuli.fps)
    with write_atomically(path) as draft:
        pictures = clip_pictures(source, times, around=making.mismatched)
        frames, luma = write_clip(draft, pictures, task.design.stimuli.fps, sound)
    return _video(task, path, frames, luma)


def _heard(
    design: Design, making: ClipMaking, voice: Waveform, seconds: float
) -> Float32Array | None:
    if making.condition.silent:
        return None
    return heard(
        voice,
        level_db=design.stimuli.loudness_db,
        snr_db=making.condition.snr_db,
        pad_s=pad_s(design),
        seconds=seconds,
        seed=design.study.seed,
    )


def _make_pair(task: _Task) -> Video:
    """Two clips side by side, with the sound that both have."""
    assert isinstance(task.video, Pair)
    clip = task.video.clips[0]
    # The mismatched one has the sound of its stimulus too.
    making = ClipMaking(task.design, task.data, clip)
    voice = making.voice()
    seconds = voice.duration_s + 2 * pad_s(task.design)
    frames = len(making.times(seconds))
    sound = _heard(task.design, making, voice, frames / task.design.stimuli.fps)
    path = _place(task)
    sides = [task.folder / VIDEOS / f"{each.name}.mp4" for each in task.video.clips]
    with write_atomically(path) as draft:
        count, luma = write_clip(draft, _side_by_side(sides), task.design.stimuli.fps, sound)
    return _video(task, path, count, luma)


def _side_by_side(sides: list[Path]) -> Iterator[np.ndarray]:
    from elocute.files.media import open_media

    with open_media(sides[0]) as left, open_media(sides[1]) as right:
        for one, other in zip(left.decode(video=0), right.decode(video=0), strict=True):
            both = [each.to_ndarray(format="rgb24") for each in (one, other)]
            yield np.concatenate(both, axis=1)


def _place(task: _Task) -> Path:
    path = task.folder / task.file
    path.parent.mkdir(parents=True, exist_ok=True)
    return path


def _video(task: _Task, path: Path, frames: int, luma: float) -> Video:
    seconds = frames / task.design.stimuli.fps
    size = path.stat().st_size
    return Video(
        task.video.name,
        task.file,
        file_sha256(path, StudyError),
        size,
        task.key,
        round(seconds, 4),
        round(luma, 2),
    )


def _notes(manifest: Manifest, pairs: list[Pair]) -> Iterator[str]:
    """What to know about the videos: brightness that differs between clips that are compared."""
    for pair in pairs:
        one, other = (manifest.videos[clip.name] for clip in pair.clips)
        if abs(one.luma - other.luma) > LUMA_DIFFERS:
            yield (
                f"{pair.stimulus}: {pair.left} has a brightness of {one.luma:.0f}, {pair.right} of "
                f"{other.luma:.0f} (of 255); people may choose by it"
            )


def _remove_others(folder: Path, manifest: Manifest) -> None:
    """Videos of an earlier version of the study, which the manifest does not name."""
    named = {folder / each.file for each in manifest.videos.values()}
    for kind in (VIDEOS, PAIRS):
        for path in (folder / kind).glob("*/*.mp4"):
            if path not in named:
                path.unlink()
