"""Branches of a slice: where they start (`seeds`, `search`), all that is connected to them (`follow`), those that
are known so far (`frontier`), and whether a state lies on one (`match`)."""
