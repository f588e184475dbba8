"""Pickles of FLAME and VOCASET, read as inert data."""
