"""What the recurrent model may hear: names that settings list before anything heavy is imported."""

from __future__ import annotations

MEL = "mel-deltas"
ENCODERS = (MEL, "trunk")
