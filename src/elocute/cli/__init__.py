"""The command `elocute`: arguments in, one library call, result out."""

import sys


def main() -> None:
    """Run the command line; Ctrl-C is handled before anything else is imported."""
    try:
        from elocute.cli.entry_point import run

        code = run()
    except KeyboardInterrupt:  # in these first moments only; then `run` handles it
        sys.stderr.write("elocute: interrupted; nothing was left half-written\n")
        code = 130
    sys.exit(code)
