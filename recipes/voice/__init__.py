"""Sounds made by formula, with which the trunk is taught what is no voice."""
