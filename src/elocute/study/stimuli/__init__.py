"""Stimuli: what a study shows and plays, rendered and listed."""
