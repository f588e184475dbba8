"""The entry point of the command line: from the start of the process to its exit code.

Exit codes: 0 done, 1 done in part, 2 bad input, 130 interrupted, 129 hung up, 143 terminated, 141
nobody read standard output. Every error is one line on stderr.
"""

from __future__ import annotations

import errno
import io
import os
import signal
import sys
import threading
import time
import warnings
from pathlib import Path
from types import FrameType
from typing import Any

from elocute.errors import (
    ElocuteError,
    ElocuteWarning,
    InputError,
    Interrupted,
    lacks_memory,
    printable,
)

UNREAD = 141
ENDINGS = {
    signal.SIGINT: "interrupted",
    signal.SIGTERM: "terminated",
    **({signal.SIGHUP: "hung up"} if hasattr(signal, "SIGHUP") else {}),
}
"""Signals that end a run as Ctrl-C does: it is cleaned up and reported in one line, and the exit
code is 128 more than the signal."""
DISK_ERRORS = {
    errno.ENOSPC,
    errno.EFBIG,
    errno.EIO,
    errno.EROFS,
    errno.EACCES,
    errno.EPERM,
    errno.EMFILE,
    errno.ENFILE,
    getattr(errno, "EDQUOT", errno.ENOSPC),
}
"""Errors of a disk or a limit, whichever file they are about."""
COMPLETE = "_ELOCUTE_COMPLETE"
"""Set by the shell where it asks for completions."""
SHELLS = ("bash", "zsh", "fish", "powershell", "pwsh")
INSTALL = "--install-completion"
IMPORTS = "<frozen importlib._bootstrap>"
LATER_S = 0.01
PATIENCE_S = 2.0
"""How long cleaning up may take before a further Ctrl-C ends the process at once."""


def run() -> int:
    """Run the command line that the process was given; returns its exit code."""
    _open_closed_streams()
    _mark_stdout_errors()
    interrupts = _Interrupts()
    return _leave(interrupts)


def _leave(interrupts: _Interrupts) -> int:
    """Run the command; whatever is caught here has left all blocks, so cleaning up is done."""
    try:
        code = _run_app()
        sys.stdout.flush()
        interrupts.ignore_further()
        return code
    except BaseException as error:
        interrupts.ignore_further()
        if interrupts.number:
            # An interruption while a compiled module loads may come as another error.
            return _report_interruption(error, interrupts.number)
        if isinstance(error, SystemExit):
            # The option parser exits so where nobody reads what it prints.
            error = error.__context__ if _is_unread(error.__context__) else error
        if isinstance(error, SystemExit):
            return _number(error.code)
        if isinstance(error, StdoutError):
            _drop_output(1)
            if _is_unread(error):
                return UNREAD
            return _say(f"standard output: cannot be written ({error.strerror})", 2)
        if isinstance(error, ElocuteError):
            return _say(str(error), 2 if isinstance(error, InputError) else 1)
        if hasattr(error, "exit_code"):
            return _usage(error)
        if isinstance(error, OSError | ValueError) and INSTALL in sys.argv:
            reason = f"{error.filename}: {error.strerror}" if isinstance(error, OSError) else error
            return _say(f"{INSTALL}: cannot be done ({reason})", 1)
        if isinstance(error, OSError) and error.errno in DISK_ERRORS:
            where = error.filename or "a temporary file"
            return _say(f"{where}: cannot be written ({error.strerror})", 2)
        if error is not None and lacks_memory(error):
            return _say("not enough memory for this; try less at once, or a larger machine", 1)
        if isinstance(error, RecursionError):
            return _say("found lists within lists too deeply; allowed: 100 of them", 2)
        if _is_unsolvable(error):
            return _say(f"found numbers that no solution fits ({error})", 2)
        if isinstance(error, OSError) and error.errno == errno.ENAMETOOLONG:
            return _say(f"{str(error.filename)[:200]}…: not a valid name ({error.strerror})", 2)
        raise


def _is_unsolvable(error: BaseException | None) -> bool:
    """Whether linear algebra gave up; NumPy is not loaded for that."""
    numpy = sys.modules.get("numpy")
    return numpy is not None and isinstance(error, numpy.linalg.LinAlgError)


def _check_completion() -> None:
    """Raise InputError where the environment asks for completions as no shell does."""
    asked = os.environ.get(COMPLETE)
    if not asked:
        return
    verb, _, shell = asked.partition("_")
    if verb not in ("source", "complete") or shell not in SHELLS:
        raise InputError.about(
            COMPLETE,
            found=repr(asked),
            allowed=f"source_SHELL or complete_SHELL, of {', '.join(SHELLS)}",
            remedy=f"unset {COMPLETE}",
        )
    words, place = os.environ.get("COMP_WORDS"), os.environ.get("COMP_CWORD", "")
    if asked == "complete_bash" and (words is None or not place.isdecimal()):
        raise InputError.about(
            f"{COMPLETE}={asked}",
            found="no COMP_WORDS with a number COMP_CWORD",
            allowed="a call by the completion of bash",
            remedy=f"unset {COMPLETE}",
        )


def _run_app() -> int:
    _check_completion()
    from elocute.cli.app import command_line

    warnings.showwarning = _show_warning
    if not sys.warnoptions:  # results are checked where it matters, and reported in one line
        warnings.simplefilter("ignore", RuntimeWarning)
        warnings.simplefilter("once", ElocuteWarning)
    # A shell that asks for completions is offered all commands.
    alone = "" if COMPLETE in os.environ else "".join(sys.argv[1:2])
    app = command_line(alone)
    return _number(app(prog_name="elocute", standalone_mode=False))


def _show_warning(message: Warning | str, category: type[Warning], *place: Any) -> None:
    """A warning of our own in a line, as errors are; others as Python has them."""
    if issubclass(category, ElocuteWarning):
        _say(str(message), 0)
    else:
        print(warnings.formatwarning(message, category, *place[:2]), end="", file=sys.stderr)


def _usage(error: Any) -> int:
    """Errors and aborts of the option parser carry their own exit code and message."""
    explain = getattr(error, "format_message", None)
    message = explain() if explain else str(error)
    context = getattr(error, "ctx", None)
    if message and context is not None:
        message = f"{message.rstrip('.')}; see {context.command_path} --help"
    return _say(message, error.exit_code) if message else error.exit_code


def _report_interruption(error: BaseException, number: int) -> int:
    from elocute.files.atomic import remove_own_drafts

    remove_own_drafts()
    done = str(error) if isinstance(error, Interrupted) else ""
    what = ENDINGS[signal.Signals(number)]
    return _say(f"{what}; {done or 'nothing was left half-written'}", 128 + number)


def _say(message: str, code: int) -> int:
    try:
        print(f"elocute: {printable(' '.join(message.split()))}", file=sys.stderr, flush=True)
    except OSError:  # the exit code says it even if stderr cannot
        _drop_output(2)
    return code


def _number(code: object) -> int:
    return code if isinstance(code, int) else 0


class StdoutError(OSError):
    """Standard output cannot be written."""


class _Stdout(io.FileIO):
    """Standard output, whose errors can be distinguished from those of any other file."""

    def write(self, data: Any) -> int | None:
        try:
            return super().write(data)
        except OSError as error:
            raise StdoutError(error.errno, error.strerror) from None


def _is_unread(error: object) -> bool:
    return isinstance(error, StdoutError) and error.errno == errno.EPIPE


def _drop_output(number: int) -> None:
    """The interpreter would try again on its way out, and complain by an exit code of its own."""
    nowhere = os.open(os.devnull, os.O_WRONLY)
    os.dup2(nowhere, number)
    os.close(nowhere)


def _open_closed_streams() -> None:
    """Give a process without stdin, stdout or stderr the null device in their place.

    A file opened later would take their number, and what is printed would go into it.
    """
    for number in range(3):
        try:
            os.fstat(number)
        except OSError:
            os.open(os.devnull, os.O_RDWR)
    if sys.stdin is None:
        sys.stdin = Path(os.devnull).open()  # noqa: SIM115
    if sys.stdout is None:
        sys.stdout = Path(os.devnull).open("w")  # noqa: SIM115
    if sys.stderr is None:
        sys.stderr = Path(os.devnull).open("w")  # noqa: SIM115


def _mark_stdout_errors() -> None:
    """Mark its errors as its own, and escape names that its encoding cannot write."""
    stream = sys.stdout
    buffer = getattr(stream, "buffer", None)
    raw = getattr(buffer, "raw", buffer)  # unbuffered (python -u) there is none between
    if type(raw) is io.FileIO:
        stream.flush()
        sys.stdout = io.TextIOWrapper(
            io.BufferedWriter(_Stdout(1, "w", closefd=False)),
            encoding=stream.encoding,
            errors="backslashreplace",
            line_buffering=bool(stream.line_buffering) or raw is buffer,
        )


class _Interrupts:
    """Turns Ctrl-C and its like into Interrupted, once; a second one does not disturb cleaning up.

    What is ignored already, as in a background job or under nohup, stays so.
    """

    def __init__(self) -> None:
        self.number = 0
        """The number of the signal that came first."""
        self._first_s = 0.0
        self._again = False
        usual = (signal.default_int_handler, signal.SIG_DFL)
        in_main_thread = threading.current_thread() is threading.main_thread()
        self._handled = [
            one for one in ENDINGS if in_main_thread and signal.getsignal(one) in usual
        ]
        if self._handled:
            self._hook, sys.unraisablehook = sys.unraisablehook, self._unraisable
        for number in self._handled:
            signal.signal(number, self._interrupt)

    def ignore_further(self) -> None:
        """The exit code is decided; no signal may change it while the interpreter ends."""
        for number in self._handled:
            signal.signal(number, signal.SIG_IGN)

    def _interrupt(self, number: int, frame: FrameType | None) -> None:
        again, self._again = self._again, False
        now = time.monotonic()
        if not self.number:
            self.number, self._first_s, again = number, now, True
        if again and _is_importing(frame):
            self._raise_later()
        elif again:
            raise Interrupted
        elif now - self._first_s > PATIENCE_S:
            os._exit(128 + self.number)

    def _unraisable(self, unraisable: Any) -> None:
        """Python drops what is raised in a finaliser or a callback: interrupt again, elsewhere.

        Finalisers of files that an interruption left open may complain; nobody wrote to those.
        """
        if issubclass(unraisable.exc_type, Interrupted):
            self._raise_later()
        elif not self.number:
            self._hook(unraisable)

    def _raise_later(self) -> None:
        later = threading.Timer(LATER_S, self._raise_again)
        later.daemon = True
        later.start()

    def _raise_again(self) -> None:
        self._again = True
        signal.raise_signal(self.number or signal.SIGINT)


def _is_importing(frame: FrameType | None) -> bool:
    """Whether a module is being loaded: compiled ones may crash where they are interrupted."""
    while frame is not None:
        if frame.f_code.co_filename == IMPORTS:
            return True
        frame = frame.f_back
    return False
