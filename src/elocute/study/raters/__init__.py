"""Simulated raters, to try a study before people see it."""
