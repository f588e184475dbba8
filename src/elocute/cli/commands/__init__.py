"""The commands, a module for each or for each part of a group: `evaluate noise` and its like
lie in `evaluate_mouth`."""
