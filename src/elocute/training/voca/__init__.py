"""Training of VOCA on a Corpus (Cudeiro et al. 2019, section 5)."""
