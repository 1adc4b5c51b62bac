"""What the command line tells apart from wrong input; below all layers."""

from __future__ import annotations


class Failure(Exception):
    """A computation that did not succeed although its input is right: told in one line, exit code 1.

    A base of the exceptions that say so, beside what else they are, as
    :class:`rodatlas.continuation.NotConverged`.
    """
