"""Reports: answers and exclusions in, tables, figures, pages and PDF out."""
