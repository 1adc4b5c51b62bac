"""The benchmark's own virtual environment, `.venv-bench` in the repository root, with the peers in it."""

import os
import shutil
import subprocess
import sys
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
FOLDER = ROOT / ".venv-bench"
PYTHON = FOLDER / ("Scripts/python.exe" if os.name == "nt" else "bin/python")

# bifpy's own makefile compiles AUTO without optimization, which makes it three times slower; make takes F90 and F77
# from MAKEFLAGS. The recorded switches let `optimized` see what an installed library was compiled with.
COMPILER = r"gfortran\ -O3\ -march=native\ -frecord-gcc-switches"
MAKEFLAGS = f"F90={COMPILER} F77={COMPILER}"

ONE_THREAD = dict.fromkeys(
    ("OMP_NUM_THREADS", "OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "NUMBA_NUM_THREADS", "BLIS_NUM_THREADS"), "1"
)


class Unavailable(Exception):
    """A peer cannot be measured here; the message says why and what would help."""


def pip(*arguments, **variables):
    """Run pip of `.venv-bench`; raise `Unavailable` with the end of its output where it fails."""
    command = [PYTHON, "-m", "pip", "install", "--quiet", "--disable-pip-version-check", *arguments]
    done = subprocess.run(command, env=os.environ | variables, capture_output=True, text=True, check=False)
    if done.returncode != 0:
        lines = [line for line in done.stderr.splitlines() if line.strip()]
        raise Unavailable(f"pip install {arguments[-1]} failed: {' '.join(lines[-2:])[:300]}")


def has(module):
    """Whether `.venv-bench` has a module."""
    code = f"import importlib.util, sys; sys.exit(importlib.util.find_spec({module!r}) is None)"
    return subprocess.run([PYTHON, "-c", code], check=False).returncode == 0


def make_folder():
    """Create `.venv-bench` if it is not there."""
    if PYTHON.exists():
        return
    done = subprocess.run([sys.executable, "-m", "venv", FOLDER], capture_output=True, text=True, check=False)
    if done.returncode != 0:
        shutil.rmtree(FOLDER, ignore_errors=True)  # without ensurepip it would have a Python but no pip
        raise Unavailable(f"python -m venv .venv-bench failed: {' '.join((done.stdout + done.stderr).split())[:300]}")


def make_scipy():
    """Put NumPy and SciPy into `.venv-bench`; raise `Unavailable` where that fails."""
    make_folder()
    if not has("scipy"):
        pip("numpy", "scipy")


def optimized():
    """Whether the installed bifpy has an AUTO library compiled with -O3."""
    archives = list(FOLDER.glob("**/bifpy/auto/_lib/libbifpy.a"))
    return bool(archives) and b"-O3" in archives[0].read_bytes()


def make_auto():
    """Put bifpy with an optimized AUTO-07p into `.venv-bench`; raise `Unavailable` without gfortran or make.

    bifpy's own requirements (plotting, symbolic mathematics) are left out: only its compiled engine is used.
    """
    missing = [tool for tool in ("gfortran", "make") if shutil.which(tool) is None]
    if missing:
        raise Unavailable(f"{' and '.join(missing)} not found; on Debian or Ubuntu: apt-get install gfortran make")
    make_folder()
    if not optimized():
        # A wheel in pip's cache may hold a library that was compiled with other flags.
        pip("--no-cache-dir", "--no-deps", "--force-reinstall", "--no-binary", "bifpy", "bifpy", MAKEFLAGS=MAKEFLAGS)
    if not optimized():
        raise Unavailable("bifpy was installed, but its AUTO library is not compiled with -O3")


def run_script(python, *arguments):
    """Run a script with one thread and return its standard output; raise `Unavailable` with its last error line."""
    done = subprocess.run(
        [python, *arguments], env=os.environ | ONE_THREAD, capture_output=True, text=True, check=False
    )
    if done.returncode != 0:
        lines = [line for line in done.stderr.splitlines() if line.strip()]
        raise Unavailable(lines[-1] if lines else f"exit status {done.returncode}")
    return done.stdout
