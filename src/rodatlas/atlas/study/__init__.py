"""Studies: many results in one folder, computed by many processes, resumable.

A study is a list of tasks. Each task writes one HDF5 file whose name carries a hash of everything that decides its
numbers; a rerun computes what is missing only.
"""

from rodatlas.atlas.study.many import TasksFailed, obtain_slices

__all__ = ["TasksFailed", "obtain_slices"]
