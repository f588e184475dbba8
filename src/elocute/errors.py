"""Errors of Elocute.

    ElocuteError
    ├── InputError          a file, a value or an option that cannot be used: exit code 2
    │   ├── AudioError      sound that cannot be read
    │   ├── HeadError       head model or identity that cannot be used
    │   ├── MotionError     motion or curves that cannot be used
    │   ├── CorpusError     a corpus, a split or a clip that cannot be used
    │   ├── AlignmentError  sequences that cannot be warped onto each other
    │   ├── CaptureError    a scan, its landmarks or a recording that cannot be registered
    │   ├── ModelError      a trained model or checkpoint that cannot be used
    │   ├── StudyError      a perceptual study, or its answers, that cannot be used
    │   └── OutputError     a place or a format that cannot be written
    └── MachineError        something this machine lacks (a renderer, for example)

A message says what was found, what is allowed and what to do, in one line.
"""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Self

NO_MEMORY = ("failed to map segment", "cannot allocate memory")
SHOWN_MAX = 600
"""Characters of what was found that a message shows."""


class ElocuteError(Exception):
    """Base of every error that Elocute raises on purpose; its message is one line."""

    def __init__(self, *told: object) -> None:
        # What a library says of a file may have lines of its own.
        super().__init__(*map(_in_one_line, told))


def _in_one_line(message: object) -> object:
    lines = message.splitlines() if isinstance(message, str) else []
    return " ".join(line.strip() for line in lines if line.strip()) if len(lines) > 1 else message


class ElocuteWarning(UserWarning):
    """Something was guessed or left out, in one line that names the file; the work goes on."""


class Interrupted(BaseException):
    """Ctrl-C on the command line; its text says what was done by then.

    Not a KeyboardInterrupt, which the option parser would catch.
    """


def printable(text: object) -> str:
    """Text as it can stand in one line of a terminal.

    Parameters
    ----------
    text
        Anything; its `str` is taken.

    Returns
    -------
    str
        With control characters, line ends and undecodable bytes of file names escaped.
    """
    return "".join(
        letter if letter.isprintable() or letter == "\u200d" else _escaped(letter)
        for letter in str(text)
    )


def _escaped(letter: str) -> str:
    return letter.encode("unicode_escape").decode()


class InputError(ElocuteError, ValueError):
    """Something given by the caller cannot be used; nothing was written."""

    @classmethod
    def about(cls, subject: str | Path, *, found: str, allowed: str = "", remedy: str = "") -> Self:
        """An error with the one-line message `subject: found; allowed: …; remedy`.

        Parameters
        ----------
        subject : str or Path
            What cannot be used: a file, or the name of a value.
        found : str
            What it is, of any length; its start is shown.
        allowed : str
            What it may be.
        remedy : str
            What to do.
        """
        parts = [_start(printable(" ".join(found.split())))]
        if allowed:
            parts.append(f"allowed: {allowed}")
        if remedy:
            parts.append(remedy)
        message = " ".join("; ".join(parts).split())
        shown = printable(subject)
        return cls(f"{shown if isinstance(subject, Path) else _start(shown)}: {printable(message)}")


class AudioError(InputError):
    """A file that cannot be read or is not sound."""


class HeadError(InputError):
    """A head model, mesh or identity that cannot be used."""


class MotionError(InputError):
    """Motion or curves that are malformed."""


class CorpusError(InputError):
    """A corpus, a split or a clip that cannot be used."""


class AlignmentError(InputError):
    """Sequences that cannot be warped onto each other, or unusable settings of their alignment."""


class CaptureError(InputError):
    """A scan, a sequence of them, their landmarks or a recording that cannot be registered."""


class ModelError(InputError):
    """A trained model, a checkpoint or a style that cannot be used."""


class StudyError(InputError):
    """A perceptual study, its videos or its answers that cannot be used."""


class OutputError(InputError):
    """An output that cannot be written: unknown suffix, missing folder, no permission."""


class MachineError(ElocuteError):
    """This machine lacks something that the request needs."""


def _start(text: str) -> str:
    return text if len(text) <= SHOWN_MAX else f"{text[:SHOWN_MAX]}…"


def lacks_memory(error: BaseException) -> bool:
    """Whether an error says that there is no memory left, for data or for a library.

    Parameters
    ----------
    error : BaseException
        A MemoryError, or what the system says where it loads a library.

    Returns
    -------
    bool
    """
    message = str(error).lower() if isinstance(error, ImportError | OSError) else ""
    return isinstance(error, MemoryError) or any(words in message for words in NO_MEMORY)


@contextmanager
def needs_extra(what: str, extra: str) -> Iterator[None]:
    """Around imports of packages that an extra installs: say which one is missing.

    Parameters
    ----------
    what : str
        What needs them, for the message.
    extra : str
        The extra.

    Raises
    ------
    MachineError
        Where one of them cannot be imported.
    """
    try:
        yield
    except ImportError as error:
        if lacks_memory(error):
            raise
        raise MachineError(
            f"{what} needs {error.name or error}; install it: pip install 'elocute[{extra}]'"
        ) from error
