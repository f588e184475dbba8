"""Encoders of the recurrent model, listed where settings can read them before anything heavy loads."""

from __future__ import annotations

MEL = "mel-deltas"
ENCODERS = (MEL, "trunk")
