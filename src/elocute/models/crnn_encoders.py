"""Encoders of the recurrent model: names that settings read before anything heavy loads."""

from __future__ import annotations

MEL = "mel-deltas"
ENCODERS = (MEL, "trunk")
