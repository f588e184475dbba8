"""A fuzzer for every reader of the package: seeded mutations of files that the tests make.

    mutations   bytes in, changed bytes out, by kind of file and drawn by a seed
    cases       a Reader, its seeds, and the case that a number stands for
    readers     the registry: every function that takes a file, a folder or a text of a user
    seeds       small valid files of every format, made here
    server      asks a process of its own to run cases
    worker      that process: it imports what readers need, and forks for every batch
    forks       processes with limits, and what they share
    judging     a case read, and what may be wrong with it
    found       cases that were found once, made again by code

`tests/fuzz` runs a few hundred cases a reader; `benchmarks/fuzz.py` runs millions.
"""
