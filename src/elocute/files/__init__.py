"""Files: read within limits, written whole or not at all.

Every other package takes its bytes, JSON and arrays from here, so that limits, refusals and their
wording are in one place.
"""
