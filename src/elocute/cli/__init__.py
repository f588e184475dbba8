"""The command `elocute`: arguments in, one library call, result out."""

from elocute.cli.app import main

__all__ = ["main"]
