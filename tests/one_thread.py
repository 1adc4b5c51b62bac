"""One thread for linear algebra, set before NumPy is loaded: this module is imported first.

Tests run in as many processes as there are cores. With threads besides, BLAS waits for cores that are taken: the second
variation of one rod took fifteen times the processor time, and eleven times as long. Worker processes of studies are
held to one thread for the same reason (`rodatlas.atlas.study.local`), which cannot be asked here: it loads NumPy.
"""

import os

NAMES = ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "BLIS_NUM_THREADS", "VECLIB_MAXIMUM_THREADS")
for name in NAMES:
    os.environ.setdefault(name, "1")
