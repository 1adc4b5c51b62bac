"""The worked examples print what they promise."""

from __future__ import annotations

import runpy
from pathlib import Path

import numpy as np
import pytest
from bvp_problems import BRATU_FOLD, EULER_LOADS

EXAMPLES = Path(__file__).parents[2] / "examples"


def run(name: str):
    return runpy.run_path(str(EXAMPLES / name))["main"]()


def test_bratu(capsys: pytest.CaptureFixture[str]) -> None:
    branch = run("bratu.py")
    assert "fold at lam = 3.5138307191" in capsys.readouterr().out
    assert branch.special[0].solution["lam"] == pytest.approx(BRATU_FOLD, abs=1e-10)


def test_elastica(capsys: pytest.CaptureFixture[str]) -> None:
    column, buckled = run("elastica.py")
    out = capsys.readouterr().out
    np.testing.assert_allclose([x.solution["P"] for x in column.special], EULER_LOADS, rtol=0, atol=1e-8)
    assert "buckling load 39.47841760" in out
    assert len(buckled) == 2
    assert out.count("P = 53.2741126") == 2
    assert out.count("energy = 22.8023670") == 2
    assert "+0.37330643" in out
    assert "-0.37330643" in out


def test_phase_separation(capsys: pytest.CaptureFixture[str]) -> None:
    uniform, front = run("phase_separation.py")
    assert "branch point at m = +0.54811919" in capsys.readouterr().out
    assert len(uniform.special) == 6
    assert front.closed
    folds = [abs(x.solution["m"]) for x in front.of_kind("fold")]
    assert len(folds) == 4
    np.testing.assert_allclose(folds, folds[0], atol=1e-8)  # four mirror images of one fold
