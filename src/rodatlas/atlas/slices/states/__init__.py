"""Stable states of a slice: stretches of branches (`segments`), their `names`, images (`mirror`) and self-`contact`;
states at one value (`coexisting`, `pick`), and those that a search should have met (`crosscheck`)."""
