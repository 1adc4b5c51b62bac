"""Loci of numbered bifurcations in clamp angle and shear: `compute`, `numbering`, `result` and `store` (its file)."""
