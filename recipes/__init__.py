"""Programs that rebuild what ships; from the repository: `python -m recipes.build_head`."""
