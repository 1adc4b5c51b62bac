"""Run a study of cheap tasks: `study_process.py FOLDER TASKS PAUSE`."""

import sys

from cheap import cheap

from rodatlas.atlas.study import Study, run_study

if __name__ == "__main__":
    folder, count, pause = sys.argv[1], int(sys.argv[2]), float(sys.argv[3])
    run_study(Study("kills", tuple(cheap(i, pause) for i in range(count))), folder, workers=2)
