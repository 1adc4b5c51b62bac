"""Real bands: what they are for the rod model, measured ranges of stability, and how they compare with a slice.

`sensitivity`: how a bifurcation moves when the clamps are set a little wrong. `real_band`: a band in mm, converted.
`measured` and `comparison`: measured ranges from a table, beside the computed ones.
"""
