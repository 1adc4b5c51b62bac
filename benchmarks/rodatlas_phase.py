"""Wall time of the phase diagram from nothing, by two processes.

Run with the project's interpreter; prints one JSON object. One slice is computed beforehand, so that nothing is
compiled in what is measured.
"""

import json
import os
import sys
import tempfile
import time
from pathlib import Path

from rodatlas import band_phase, band_slice, compute_slice
from rodatlas.atlas.phase.obtain import obtain_phase

WORKERS = 2


def main():
    compute_slice(band_slice(20.0, shear_max=0.1))
    load = os.getloadavg()[0] if hasattr(os, "getloadavg") else None
    with tempfile.TemporaryDirectory() as folder:
        begin = time.perf_counter()
        found = obtain_phase(band_phase(), Path(folder), workers=WORKERS)
        seconds = time.perf_counter() - begin
    json.dump({
        "name": "rodatlas", "load": load, "workers": WORKERS, "seconds": seconds, "slices": len(found.places),
        "faces": len(found.faces), "lines": len(found.lines), "warnings": len(found.warnings),
    }, sys.stdout, indent=1)  # fmt: skip
    print()


if __name__ == "__main__":
    main()
