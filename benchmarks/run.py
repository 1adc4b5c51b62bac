"""Benchmarks: a branch and two loci by rodatlas, AUTO-07p and SciPy in one run, in turn, one thread each; slices by one
and by two processes; growing numbers of unknowns; the search for states; and the phase diagram.

Started by `make bench` with the project's interpreter. The peers live in `.venv-bench`, which is made on the first
run; a peer that cannot be had here is named and left out. Prints the reports and writes them to `results/`.
"""

import argparse
import json
import sys
import tempfile
from pathlib import Path

import environment
import report
import report_loci
import report_phase
import report_scaling
import report_sizes
import report_states

HERE = Path(__file__).resolve().parent
SCIPY = HERE / "peers" / "scipy_u_branch.py"


def add_auto(found, script, work, notes):
    """Add every case of one of AUTO's scripts to the programs, or a note on why it cannot run here."""
    peer = str(environment.PYTHON)
    try:
        environment.make_auto()
        environment.run_script(peer, script, "prepare", work)
        for case in json.loads(environment.run_script(peer, script, "cases")):
            found[f"auto {case}"] = (peer, script, "measure", work, case)
    except environment.Unavailable as reason:
        notes.append(f"AUTO-07p: {reason}")


def branch_programs(work, notes):
    """Programs that follow the U branch.

    Parameters
    ----------
    work : Path
        Folder for AUTO's executable and files.
    notes : list of str
        Gets one line per program that is left out.

    Returns
    -------
    dict from name to command line, of what can run here.
    """
    ours = HERE / "rodatlas_u_branch.py"
    found = {
        " ".join(["rodatlas", *how]): (sys.executable, ours, *how)
        for how in ((), ("fixed", "chord"), ("adaptive",), ("adaptive", "chord"), ("fast",), ("fast", "chord"))
    }
    try:
        environment.make_scipy()
        found["scipy"] = (str(environment.PYTHON), SCIPY)
    except environment.Unavailable as reason:
        notes.append(f"SciPy: {reason}")
    add_auto(found, HERE / "peers" / "auto_u_branch.py", work, notes)
    return found


def locus_programs(work, notes):
    """Programs that follow the loci, as :func:`branch_programs`."""
    found = {"rodatlas": (sys.executable, HERE / "rodatlas_loci.py")}
    add_auto(found, HERE / "peers" / "auto_loci.py", work, notes)
    return found


def scaling_programs(work, notes):
    """Studies by one and by two processes, as :func:`branch_programs`; no peer does this."""
    return {"rodatlas": (sys.executable, HERE / "rodatlas_scaling.py")}


def size_programs(work, notes):
    """Coupled equations in growing number, as :func:`branch_programs`; no peer does this."""
    return {"rodatlas": (sys.executable, HERE / "rodatlas_sizes.py")}


def state_programs(work, notes):
    """The search for states, as :func:`branch_programs`."""
    return {"rodatlas": (sys.executable, HERE / "rodatlas_states.py")}


def phase_programs(work, notes):
    """The phase diagram, as :func:`branch_programs`."""
    return {"rodatlas": (sys.executable, HERE / "rodatlas_phase.py")}


ONCE = ("phase",)  # takes minutes
BENCHMARKS = {
    "u_branch": (branch_programs, report.text),
    "loci": (locus_programs, report_loci.text),
    "scaling": (scaling_programs, report_scaling.text),
    "sizes": (size_programs, report_sizes.text),
    "states": (state_programs, report_states.text),
    "phase": (phase_programs, report_phase.text),
}


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
    """Command line: `run.py [--rounds N] [--only NAME]`."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--rounds", type=int, default=5, help="how often every program runs (default 5)")
    parser.add_argument("--only", choices=BENCHMARKS, help="one of the benchmarks instead of all")
    arguments = parser.parse_args()
    if arguments.rounds < 1:
        parser.error(f"--rounds: expected a number of at least 1, got {arguments.rounds}")
    for name in [arguments.only] if arguments.only else BENCHMARKS:
        programs, text = BENCHMARKS[name]
        notes = []
        rounds = 1 if name in ONCE else arguments.rounds
        with tempfile.TemporaryDirectory() as folder:
            results = measure(programs(Path(folder), notes), rounds, notes)
        written = text(results, notes, rounds)
        target = HERE / "results" / f"{name}.txt"
        target.parent.mkdir(exist_ok=True)
        target.write_text(written)
        print(written)


if __name__ == "__main__":
    main()
