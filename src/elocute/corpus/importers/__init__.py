"""Importers: folders as others distribute them, turned into a corpus."""
