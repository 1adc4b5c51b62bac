"""Branches: one step after another, events between them, the check afterwards, and how to start."""
