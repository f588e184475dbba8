"""Figures of curves and alignments."""
