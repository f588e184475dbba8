"""Whether espeak-ng is here, which some tests speak with."""

from functools import cache

from elocute.errors import MachineError
from elocute.speech import speak


@cache
def has_espeak() -> bool:
    try:
        speak("a")
    except MachineError:
        return False
    return True
