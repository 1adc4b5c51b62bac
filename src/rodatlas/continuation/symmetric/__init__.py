"""Symmetries of a solution, and the subspace of the symmetric ones."""
