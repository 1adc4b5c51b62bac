"""Equilibria, stability and bifurcations of clamped elastic rods and bands."""

__version__ = "0.1.0"
