"""The plane of clamp angle and shear, cut by loci into faces with the stable states that live there.

In the order of the work: `settings`; `lines` (loci as polylines), `arrangement` (the faces between them), `cover`
(angles at which slices meet all of them), `changes` (smooth changes of name), `regions` (states of faces, and what does
not add up), `story` (events in words), `compute`; `result`, `store` (its file) and `obtain`.
"""
