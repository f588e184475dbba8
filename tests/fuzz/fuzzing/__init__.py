"""A fuzzer for every reader of the package: seeded mutations of files that the tests make.

    mutations   bytes in, changed bytes out, by kind of file and drawn by a seed
    cases       a Reader, its seeds, and the case that a number stands for
    readers     the registry: every function that takes a file, a folder or a text of a user
    seeds       small valid files of every format, made here
    worker      a server that forks a process for every batch and judges what each case did
    found       cases that were found once, made again by code

`tests/fuzz` runs a few hundred cases a reader; `benchmarks/fuzz.py` runs millions.
"""
