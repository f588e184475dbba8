"""Mouth cues and captions for drawn characters and players."""
