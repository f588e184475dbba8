"""Words and sentences by synthetic voices, with exact phone times, to judge alignments by."""
