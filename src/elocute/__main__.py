"""`python -m elocute`, the same as the command `elocute`."""

from elocute.cli import main

if __name__ == "__main__":
    main()
