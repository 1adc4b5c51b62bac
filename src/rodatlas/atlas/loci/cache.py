"""Finished loci of a computation that is under way, so that an interrupted run resumes."""

from __future__ import annotations

from pathlib import Path

from rodatlas.atlas.unfinished import CurveFolder
from rodatlas.continuation import Locus


class LocusCache:
    """Keeps finished loci by name; this one forgets them at once."""

    def get(self, key: str) -> Locus | None:
        """The locus that was put under a name, if any."""
        return None

    def put(self, key: str, locus: Locus) -> None:
        """Keep a finished locus."""


class LocusFolder(CurveFolder[Locus], LocusCache):
    """Loci of one result in a folder."""

    def _load(self, path: Path) -> Locus:
        return Locus.load(path)
