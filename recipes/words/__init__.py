"""An LRW-like corpus of our own: words, voices, captured readings."""
