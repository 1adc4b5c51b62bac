"""The one table of short labels, used in plots and tables only."""

LABELS = {
    "fold": "LP",
    "branch point": "BP",
    "pitchfork": "PF",
    "cusp": "CP",
    "zero": "UZ",
    "extremum": "EX",
    "end": "EP",
    "no convergence": "MX",
}
