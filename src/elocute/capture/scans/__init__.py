"""Scans: reading them, checking them, and the landmarks on them."""
