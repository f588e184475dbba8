"""Parts of `recipes/build_head.py`: the built-in head, made from MakeHuman's CC0 data."""
