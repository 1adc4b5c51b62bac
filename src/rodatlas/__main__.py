"""`python -m rodatlas`."""

from rodatlas.cli import main

main()
