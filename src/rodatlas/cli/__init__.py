"""The command line: `rodatlas slice`, `rodatlas loci`, `rodatlas solve`."""

from rodatlas.cli.app import main

__all__ = ["main"]
