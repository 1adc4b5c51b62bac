"""Branches of a slice: where they start (`seeds`, `search`), all that is connected to them (`follow`), finished ones of
a run under way (`cache`), and whether a state lies on one (`match`)."""
