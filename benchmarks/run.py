"""Benchmark: the U branch by rodatlas, AUTO-07p and SciPy in one run, in turn, one thread each.

Started by `make bench` with the project's interpreter. The peers live in `.venv-bench`, which is made on the first
run; a peer that cannot be had here is named and left out. Prints the report and writes `results/u_branch.txt`.
"""

import argparse
import json
import sys
import tempfile
from pathlib import Path

import environment
import report

HERE = Path(__file__).resolve().parent
AUTO = HERE / "peers" / "auto_u_branch.py"
SCIPY = HERE / "peers" / "scipy_u_branch.py"
OURS = HERE / "rodatlas_u_branch.py"


def commands(work, notes):
    """Command line of every program that can run here, by name; add to ``notes`` what cannot.

    Parameters
    ----------
    work : Path
        Folder for AUTO's executable and files.
    notes : list of str
        Gets one line per program that is left out.
    """
    found = {"rodatlas": (sys.executable, OURS), "rodatlas adaptive": (sys.executable, OURS, "adaptive")}
    peer = str(environment.PYTHON)
    try:
        environment.make_scipy()
        found["scipy"] = (peer, SCIPY)
    except environment.Unavailable as reason:
        notes.append(f"SciPy: {reason}")
    try:
        environment.make_auto()
        environment.run_script(peer, AUTO, "prepare", work)
        for case in json.loads(environment.run_script(peer, AUTO, "cases")):
            found[f"auto {case}"] = (peer, AUTO, "measure", work, case)
    except environment.Unavailable as reason:
        notes.append(f"AUTO-07p: {reason}")
    return found


def measure(programs, rounds, notes):
    """Run every program once per round, in turn; one that fails is noted once and dropped."""
    results = {name: [] for name in programs}
    dropped = set()
    for number in range(rounds):
        for name, command in programs.items():
            if name in dropped:
                continue
            print(f"round {number + 1} of {rounds}: {name}", file=sys.stderr)
            try:
                results[name].append(json.loads(environment.run_script(*command)))
            except environment.Unavailable as reason:
                dropped.add(name)
                notes.append(f"{name}: {reason}")
    return results


def main():
    """Command line: `run.py [--rounds N]`."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5, help="how often every program runs (default 5)")
    rounds = parser.parse_args().rounds
    if rounds < 1:
        parser.error(f"--rounds: expected a number of at least 1, got {rounds}")
    notes = []
    with tempfile.TemporaryDirectory() as folder:
        results = measure(commands(Path(folder), notes), rounds, notes)
    text = report.text(results, notes, rounds)
    target = HERE / "results" / "u_branch.txt"
    target.parent.mkdir(exist_ok=True)
    target.write_text(text)
    print(text)


if __name__ == "__main__":
    main()
