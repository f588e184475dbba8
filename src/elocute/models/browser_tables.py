"""What `web/speech` needs to know of the model `talkers`: one JSON, so that nothing is typed twice.

    python -m elocute.models.browser_tables FOLDER

writes `tables.json` into a folder, and a copy of the trunk beside it.
"""

from __future__ import annotations

import json
import shutil
import sys
from dataclasses import asdict
from pathlib import Path
from types import ModuleType
from typing import Any

from elocute.articulation import (
    coarticulation,
    contact_decoding,
    driver,
    mouth_solver,
    phone_targets,
    rest,
)
from elocute.articulation.contacts_and_rest import SPEECH_FLOOR
from elocute.articulation.style import STYLES
from elocute.audio import resampling_stream, whisper_mel
from elocute.audio.waveform import RATE_RANGE
from elocute.encoders import trunk
from elocute.encoders.phones_and_visemes import PHONES
from elocute.models import curve_stream, talkers
from elocute.motion import mouth_response
from elocute.motion.mouth_measures import TRACKED_MEASURES
from elocute.numerics.spectra import hann

PLAIN_TYPES = (bool, int, float, str, tuple, list, dict)


def browser_tables() -> dict[str, Any]:
    """All numbers and names of `talkers` but its weights, as plain data for JSON.

    Constants of a module stand under their own names.
    """
    names = phone_targets.curve_names()
    response = mouth_response.builtin_response(names)
    pace = {name: asdict(each) for name, each in _paces().items()}
    return {
        "phones": PHONES,
        "curves": names,
        "measures": TRACKED_MEASURES,
        "styles": {name: asdict(style) for name, style in STYLES.items()},
        "mel": _constants(whisper_mel)
        | {
            "window": hann(whisper_mel.WINDOW).tolist(),
            "weights": [_nonzero(band) for band in whisper_mel.mel_weights().T.tolist()],
        },
        "trunk": _constants(trunk)
        | {
            "FAR": float(trunk.FAR),
            "record": trunk.builtin_trunk().record,
            "paces": pace,
            "silence_alone": trunk.SILENCE_ALONE.tolist(),
        },
        "resampling": _constants(resampling_stream),
        "coarticulation": _constants(coarticulation)
        | {
            "groups": phone_targets.curve_groups().tolist(),
            "targets": phone_targets.phone_targets().tolist(),
            "dominances": phone_targets.phone_dominances().tolist(),
        },
        "contacts": _constants(contact_decoding) | {"SPEECH_FLOOR": SPEECH_FLOOR},
        "rest": _constants(rest),
        "driver": _constants(driver),
        "mouth": _constants(mouth_solver)
        | _constants(mouth_response)
        | {"effects": response.effects.tolist(), "rest": response.rest.tolist()},
        "talkers": _constants(talkers)
        | {name: values.tolist() for name, values in vars(talkers.mouth_sizes()).items()}
        | {"decoder_lookahead_s": talkers.TalkersModel.decoder_lookahead_s},
        "stream": _constants(curve_stream) | {"RATE_RANGE": RATE_RANGE},
    }


def _constants(module: ModuleType) -> dict[str, Any]:
    """A module's constants that JSON can hold, those that it imports among them."""
    return {
        name: value
        for name, value in vars(module).items()
        if name.isupper() and isinstance(value, PLAIN_TYPES) and _plain(value)
    }


def _plain(value: object) -> bool:
    try:
        json.dumps(value, allow_nan=False)
    except (TypeError, ValueError):
        return False
    return True


def _paces() -> dict[str, trunk.Pace]:
    """The pace of a whole sound, and of sound that is answered at once, the cheapest first."""
    live = {f"live_{place}": pace for place, pace in enumerate(trunk.LIVE_PACES)}
    return {"whole": trunk.WHOLE, **live}


def _nonzero(band: list[float]) -> dict[str, Any]:
    """Where a row of mostly zeros begins to be none, and what stands there."""
    places = [place for place, value in enumerate(band) if value]
    return {"first": places[0], "values": band[places[0] : places[-1] + 1]}


def write_browser_tables(folder: Path) -> None:
    """Write `tables.json` into a folder, which is made, and a copy of the trunk beside it."""
    folder.mkdir(parents=True, exist_ok=True)
    text = json.dumps(browser_tables(), separators=(",", ":"), allow_nan=False)
    (folder / "tables.json").write_text(text, encoding="utf-8")
    shutil.copyfile(trunk.SHIPPED_PATH, folder / trunk.SHIPPED_PATH.name)


if __name__ == "__main__":
    write_browser_tables(Path(sys.argv[1]))
