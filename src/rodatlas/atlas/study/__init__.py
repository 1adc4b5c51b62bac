"""Studies: many results in one folder, computed by many processes, resumable.

A study is a list of tasks. Each task writes one HDF5 file whose name carries a hash of everything that decides its
numbers; a rerun computes what is missing only.
"""

from rodatlas.atlas.study.kinds import StatesSettings
from rodatlas.atlas.study.listing import Listing, list_folder
from rodatlas.atlas.study.local import LocalExecutor
from rodatlas.atlas.study.many import TasksFailed, obtain_slices
from rodatlas.atlas.study.outcome import Event, Outcome, Status, StudyResult
from rodatlas.atlas.study.plan import Study
from rodatlas.atlas.study.run import run_study
from rodatlas.atlas.study.task import Task

__all__ = [
    "Event", "Listing", "LocalExecutor", "Outcome", "StatesSettings", "Status", "Study", "StudyResult", "Task",
    "TasksFailed", "list_folder", "obtain_slices", "run_study",
]  # fmt: skip
