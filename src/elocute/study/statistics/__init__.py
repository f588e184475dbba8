"""Statistics of ratings and choices."""
