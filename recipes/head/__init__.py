"""Parts of the recipe for the built-in head."""
