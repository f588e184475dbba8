"""Files: read within a budget, written whole or not at all.

Every reader of the project takes its bytes, JSON and arrays from here, so that limits, refusals
and their wording stand once.
"""
