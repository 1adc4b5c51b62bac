"""Shapes and fields of states: profiles, energies, galleries, critical modes, sequences, the set-up."""
