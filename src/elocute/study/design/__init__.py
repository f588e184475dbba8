"""Designs of studies: the file, the trials, and how many raters are needed."""
