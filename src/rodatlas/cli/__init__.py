"""The command line: `rodatlas slice`, `rodatlas loci`, `rodatlas solve`."""

from rodatlas.cli.entry import main

__all__ = ["main"]
