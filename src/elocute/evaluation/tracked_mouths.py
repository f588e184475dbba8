"""Mouths of real talkers, tracked in video, with their sound.

Two layouts are read. A plain folder holds `NAME.ogg` (or another sound) and `NAME.npz` with `t`
(s), `inner_opening_mean` and `lip_width` (in units of the outer eye-corner distance), `valid` and
`words`, a JSON text of [start s, end s, word]; `protrusion` may be there too. A folder of many
talkers holds the same in `clips/`, and a `manifest.json` whose `clips` give `id`, `speaker`,
`language` and `offset_s`, how late the mouth is against the sound. Times of phones may lie beside a
clip, as `NAME.TextGrid`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from elocute.array_types import Float64Array
from elocute.corpus.importers.grid import FIELDS_MAX_BYTES
from elocute.errors import InputError
from elocute.files.array_reading import read_npz
from elocute.files.json_records import finite_number, parse_json, read_record
from elocute.files.reading import FileKind
from elocute.one_line_repr import one_line
from elocute.speech.times.read import read_speech_times

SOUNDS = (".ogg", ".wav", ".flac", ".mp3", ".m4a", ".opus")
MANIFEST, CLIPS = "manifest.json", "clips"
MANIFEST_MAX_BYTES = 64_000_000
OFFSET_MAX_S = 1.0
TRACKED_FIELDS = ("t", "inner_opening_mean", "lip_width", "valid")
FIELDS = frozenset((*TRACKED_FIELDS, "protrusion", "words"))
ALLOWED = "a short recording with the fields of grid_s1"
FIELDS_FILE = FileKind(ALLOWED, FIELDS_MAX_BYTES)


@dataclass(frozen=True)
class TrackedClip:
    """Where one recording's .npz lies, whose it is, and in which language ("" where none is named).

    offset_s: how late the tracked mouth is against the sound.
    """

    path: Path
    talker: str
    language: str = ""
    offset_s: float = 0.0


@dataclass(frozen=True, eq=False)
class TrackedMouth:
    """The mouth of one tracked recording.

    Attributes
    ----------
    sound : Path
        The sound beside it.
    times_s : (frame,) float64
        Time of each frame, s.
    opening, width, protrusion : (frame,) float64
        Gap between the inner lips, width of the mouth and how far the lips stand out, in units of
        the outer eye-corner distance; NaN throughout where a measure was not tracked.
    valid : (frame,) bool
        Whether the mouth was seen.
    words : list of (float, float, str)
        Start in s, end in s and word.
    talker, language, offset_s
        As in `TrackedClip`.
    phones : tuple of (float, float, str) or None
        Start in s, end in s and ARPAbet phone, where a file beside the clip tells them.
    """

    name: str
    sound: Path
    times_s: Float64Array
    opening: Float64Array
    width: Float64Array
    protrusion: Float64Array
    valid: NDArray[np.bool_]
    words: list[tuple[float, float, str]]
    talker: str = ""
    language: str = ""
    offset_s: float = 0.0
    phones: tuple[tuple[float, float, str], ...] | None = None

    __repr__ = one_line


def find_tracked_mouths(folder: str | Path, names: list[str] | None = None) -> list[TrackedClip]:
    """Find the recordings of a folder in either layout, by name or in the order of `names`.

    Raises InputError where there is none, or one is missing, and for a manifest that cannot be
    read.
    """
    folder = Path(folder)
    if not folder.is_dir():
        raise InputError.about(folder, found="no folder", allowed="a folder of NAME.npz and sound")
    about = _manifest(folder)
    place = folder / CLIPS if about is not None else folder
    if names is not None:
        paths = [place / f"{Path(name).name}.npz" for name in names]
    elif about is not None:
        paths = [place / f"{name}.npz" for name in sorted(about)]
    else:
        paths = sorted(place.glob("*.npz"))
    missing = [path for path in paths if not path.is_file()]
    if missing or not paths:
        fault = f"{missing[0].name} is missing" if missing else "no .npz file"
        raise InputError.about(place, found=fault, allowed="NAME.npz with NAME.ogg beside it")
    plain = folder.parent.name if folder.name == CLIPS else folder.name
    return [(about or {}).get(path.stem, TrackedClip(path, plain)) for path in paths]


def _manifest(folder: Path) -> dict[str, TrackedClip] | None:
    """Tracked clips by name; None without a manifest. Curves of a rig are no tracked mouths."""
    path = folder / MANIFEST
    if not path.is_file():
        return None
    allowed = "a manifest of talkers: clips with id, speaker and language"
    record = read_record(path, FileKind(allowed, MANIFEST_MAX_BYTES))
    clips = record.get("clips")
    if not isinstance(clips, list) or not all(isinstance(clip, dict) for clip in clips):
        raise InputError.about(path, found="no list of clips", allowed=allowed)
    tracked = [clip for clip in clips if clip.get("kind") != "curves"]
    return {clip.path.stem: clip for clip in (_of_manifest(each, path) for each in tracked)}


def _of_manifest(clip: Mapping[str, Any], path: Path) -> TrackedClip:
    name, talker, language = (clip.get(key) for key in ("id", "speaker", "language"))
    offset_s = 0.0 if clip.get("offset_s") is None else finite_number(clip["offset_s"])
    named = isinstance(name, str) and name == Path(name).name and isinstance(talker, str)
    if not named or offset_s is None or abs(offset_s) > OFFSET_MAX_S:
        raise InputError.about(
            path,
            found=f"a clip without a plain id, a speaker or an offset ({str(name)[:60]})",
            allowed=f"id, speaker, offset_s within {OFFSET_MAX_S:g} s or null",
        )
    place = path.parent / CLIPS / f"{name}.npz"
    return TrackedClip(place, str(talker), str(language or ""), float(offset_s))


def read_tracked_mouth(clip: TrackedClip | Path) -> TrackedMouth:
    """Read one recording, as `find_tracked_mouths` finds it or its `.npz`.

    Raises InputError for a missing field or sound, too few valid frames, or numbers that are not
    finite.
    """
    if isinstance(clip, Path):
        clip = TrackedClip(clip, clip.parent.name)
    path = clip.path
    sound = next((s for s in (path.with_suffix(x) for x in SOUNDS) if s.is_file()), None)
    if sound is None:
        raise InputError.about(path, found="no sound beside it", allowed=" ".join(SOUNDS))
    fields = read_npz(path, FIELDS_FILE, only=FIELDS)
    try:
        times_s, opening, width, valid = (
            np.asarray(fields[name], float) for name in TRACKED_FIELDS
        )
        protrusion = np.asarray(fields.get("protrusion", np.full(valid.shape, np.nan)), float)
        rows = parse_json(str(fields["words"]), path, allowed=ALLOWED)
        words = [(float(a), float(b), str(w)) for a, b, w in rows]
    except (KeyError, ValueError, TypeError) as error:
        raise InputError.about(
            path, found=f"no tracked mouth in it ({str(error)[:120]})", allowed=ALLOWED
        ) from error
    tracks, seen = (times_s, opening, width, protrusion), valid > 0.5
    if any(track.shape != valid.shape or track.ndim != 1 for track in tracks) or seen.sum() < 10:
        raise InputError.about(path, found="too few valid frames", allowed="10 frames or more")
    if not (np.isfinite(times_s).all() and all(np.isfinite(t[seen]).all() for t in tracks[:3])):
        raise InputError.about(path, found="NaN or infinity in it", allowed="finite numbers")
    return TrackedMouth(
        path.stem,
        sound,
        times_s,
        opening,
        width,
        protrusion,
        seen,
        words,
        clip.talker,
        clip.language,
        clip.offset_s,
        _phones_beside(path),
    )


def _phones_beside(path: Path) -> tuple[tuple[float, float, str], ...] | None:
    labels = path.with_suffix(".TextGrid")
    return read_speech_times(labels).phones if labels.is_file() else None
