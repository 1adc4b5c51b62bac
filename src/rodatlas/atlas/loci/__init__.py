"""Loci of the bifurcations of slices in a plane of two controls.

`settings` (the plane), `stretches` (curves cut where the second control turns), `partners` (what else must be
followed), `compute`; `events` (special points in words), `result` and `store` (its file).
"""
