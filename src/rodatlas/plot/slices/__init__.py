"""Diagrams of slices: curves, panels, insets, close-ups, and measured ranges laid over them."""
