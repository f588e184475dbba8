"""Training of the network of Karras et al. 2017 on a Corpus."""
