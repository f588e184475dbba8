"""Texts and what they say about the phones of a recording."""
