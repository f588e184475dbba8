"""Speech blendshapes: a linear basis learned from registered speech (in the wild 2019, 3.3)."""
