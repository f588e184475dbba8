"""Training of the recurrent model on shards (Tzirakis et al. 2019, sections 5 and 6)."""
