"""The one table of short labels, used in plots and tables only."""

LABELS = {"fold": "LP", "branch point": "BP", "zero": "UZ", "extremum": "EX"}
