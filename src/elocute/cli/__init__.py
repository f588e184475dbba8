"""The command `elocute`: arguments in, one library call, result out."""

import gc
import sys


def main() -> None:
    """Run the command line; Ctrl-C is handled before anything else is imported."""
    try:
        from elocute.cli.entry_point import run

        code = run()
    except BaseException as error:  # in these first moments only; then `run` handles it
        if not _is_interruption(error):
            raise
        sys.stderr.write("elocute: interrupted; nothing was left half-written\n")
        code = 130
    gc.freeze()  # else Python looks through all objects once more: a third of a second, or more
    sys.exit(code)


def _is_interruption(error: BaseException | None) -> bool:
    """True for Ctrl-C, or what Python made of it (3.11 raises another error from a class body)."""
    while error is not None and not isinstance(error, KeyboardInterrupt):
        error = error.__cause__ or error.__context__
    return error is not None
