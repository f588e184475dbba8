"""Speech synthesis: a text in, its sound and the times of its phones out."""
