"""Parts of the recipe for the speech encoder `phones`."""
