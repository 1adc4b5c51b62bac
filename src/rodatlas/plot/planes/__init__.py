"""Diagrams over two controls: loci, regions of stability, and bifurcations against a parameter."""
