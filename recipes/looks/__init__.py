"""What the built-in head wears: skins, hair, brows, lashes, eyes, clothes, from CC0 assets."""
