"""What a computation that was interrupted finds again, wherever it is kept."""

from dataclasses import dataclass

import numpy as np
import pytest

from rodatlas.atlas import Cache, FolderCache, MemoryCache
from rodatlas.atlas.cache import BRANCH, LOCUS, SOLUTIONS, PrefixedCache
from rodatlas.continuation import BVP, MeshControl, Solution, TraceOptions, follow_locus, trace

BVP_OF_BRATU = BVP(
    rhs=lambda s, u, p: {"u": u.v, "v": -p.lam * np.exp(p.eps * u.u)},
    boundary=lambda left, right, p: [left.u, right.u],
    unknowns=("u", "v"), parameters={"lam": 0.0, "eps": 1.0},
)  # fmt: skip
FOLD = 3.513830719  # lambda of Bratu's problem with eps = 1


@dataclass(frozen=True)
class Some:
    number: int = 1

    def identity(self):
        return {"number": self.number}


@pytest.fixture(scope="module")
def parts():
    """A branch with a fold, its locus, and some solutions."""
    start = Solution.from_function(lambda s: np.zeros((len(s), 2)), BVP_OF_BRATU.unknowns, BVP_OF_BRATU.parameters)
    options = TraceOptions(bounds={"lam": (0.0, 4.0)}, mesh=MeshControl(tolerance=1e-6), max_folds=1)
    branch = trace(BVP_OF_BRATU, start, ("lam",), options)
    fold = next(x for x in branch.special if x.kind == "fold")
    near = TraceOptions(bounds={"eps": (0.9, 1.1)}, mesh=MeshControl(tolerance=1e-6))
    locus = follow_locus(BVP_OF_BRATU, fold, ("lam", "eps"), near)
    return branch, locus, tuple(p.solution for p in branch.points[:3])


def caches(folder):
    """Each way to keep parts."""
    return {
        "memory": MemoryCache(), "folder": FolderCache(folder / "s", Some()),
        "prefixed": PrefixedCache(FolderCache(folder / "inner", Some()), "first-"),
        "prefixed in memory": PrefixedCache(MemoryCache(), "first-"),
    }  # fmt: skip


@pytest.mark.parametrize("where", ["memory", "folder", "prefixed", "prefixed in memory"])
def test_what_is_put_is_got(parts, tmp_path, where):
    cache: Cache = caches(tmp_path)[where]
    branch, locus, solutions = parts
    everything = (("b", branch, BRANCH), ("l", locus, LOCUS), ("s", solutions, SOLUTIONS), ("none", (), SOLUTIONS))
    for key, part, form in everything:
        assert cache.get(key, form) is None
        cache.put(key, part, form)
    kept = cache.get("b", BRANCH)
    assert kept.to_frame().equals(branch.to_frame())
    assert next(x for x in kept.special if x.kind == "fold").solution["lam"] == pytest.approx(FOLD, abs=1e-6)
    # lambda times eps is what counts, after u is scaled by eps: the fold lies on a hyperbola
    products = [p.solution["lam"] * p.solution["eps"] for p in cache.get("l", LOCUS).points]
    assert products == pytest.approx([FOLD] * len(locus.points), abs=1e-6)
    for one, two in zip(cache.get("s", SOLUTIONS), solutions, strict=True):
        assert np.array_equal(one.values, two.values)
    assert cache.get("none", SOLUTIONS) == ()


def test_a_prefix_keeps_names_apart(parts, tmp_path):
    cache = FolderCache(tmp_path / "s", Some())
    one, two = PrefixedCache(cache, "one-"), PrefixedCache(cache, "two-")
    one.put("U", parts[0], BRANCH)
    assert two.get("U", BRANCH) is None
    assert cache.get("one-U", BRANCH) is not None
    assert [p.name for p in cache.folder.glob("*.h5")] == ["one-U.h5"]


def test_a_part_of_another_kind_is_computed_again(parts, tmp_path):
    said = []
    cache = FolderCache(tmp_path / "s", Some(), say=said.append)
    cache.put("U", parts[2], SOLUTIONS)
    assert cache.get("U", BRANCH) is None
    assert "s/U.h5 is damaged and is computed again" in said[0]
    assert len(cache) == 0


def test_settings_without_identity_are_refused(tmp_path):
    with pytest.raises(ValueError, match=r"^settings: expected settings that have an identity, .* got 15\.0$"):
        FolderCache(tmp_path / "s", 15.0)
