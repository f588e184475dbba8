"""Figures of curves and alignments, drawn with matplotlib."""
