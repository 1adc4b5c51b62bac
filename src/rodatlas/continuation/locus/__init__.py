"""Loci: special points followed in two parameters, and the events on them."""
