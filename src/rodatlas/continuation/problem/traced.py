"""What the user wrote, traced once with symbols, and the functions of the reference interval made of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from rodatlas.continuation.linear.sparsity import Sparsity, strong_components
from rodatlas.continuation.problem.layout import Inner, Layout, Place, laid_out
from rodatlas.continuation.problem.observable import Observable
from rodatlas.continuation.problem.tracing import Named, Tracer, function_of, numpy_semantics, pattern_of, second_of

SAME_DEPTH = 16  # of expressions for places, in which they are compared


@dataclass(frozen=True)
class Statement:
    """A problem as the user states it; see :class:`rodatlas.continuation.problem.bvp.BVP` for the fields."""

    unknowns: tuple[str, ...]
    parameters: Mapping[str, float]
    log: tuple[str, ...]
    rhs: tuple[Callable[..., Any], ...]
    boundary: Callable[..., Any]
    integrals: tuple[Callable[..., Any], ...]
    interval: tuple[Place, Place]
    breakpoints: tuple[Place, ...]
    inner: tuple[Inner, ...]
    observables: Mapping[str, Observable]
    identities: Callable[..., Any] | None
    held: Mapping[str, str] = field(default_factory=dict)  # observable -> parameter that is its value
    phases: int = 0  # integrals of nothing, the last ones, in whose place phase conditions are put on a mesh

    def inner_places(self) -> list[Place]:
        """Places where something jumps, holds or is measured."""
        return [x.at for x in self.inner] + [x.at for x in self.observables.values() if x.at is not None]


@dataclass(frozen=True)
class Traced:
    """CasADi functions of one problem on its reference interval; each is evaluated at many points by

    `field`: (x, u, p) -> f (n,), nonzeros of f_u (nnz,), f_p (n, k) column-major by those parameters `moving` (k,) that
    f depends on; `values` gives f alone.
    `field_second`: (x, u, p, v, vp, w) -> gradients in u and p of w.(f_u v + f_p vp).
    `ends`, `ends_second`: the same for b(u0, u1, p), with u = (u0, u1).
    `densities`, `densities_second`: the same for the integrands, dense.
    `identities`: (u, p) -> what vanishes along every solution, and both derivatives; None where nothing is declared.
    `places`: p -> places of the ends of pieces, in the user's coordinate; `fixed_places` (K+1, 2) are knots and places
    where these depend on no parameter.
    `parts`: (x, u, p) -> f and integrands of each law and inner point; `choice` composes the functions above of them.

    Here p holds logarithms of those parameters that are followed in their logarithm.
    """

    field: Any
    moving: np.ndarray
    values: Any
    field_second: Any
    ends: Any
    ends_second: Any
    densities: Any
    densities_second: Any
    identities: Any
    places: Any
    fixed_places: np.ndarray | None
    parts: tuple[tuple[Any, Any], ...]
    choice: Choice


@dataclass(frozen=True, eq=False)
class Choice:
    """Which of several expressions holds where on the reference interval.

    Attributes
    ----------
    starts : (K,) where its parts begin; owner : (K,) number of the expression on each.
    """

    starts: np.ndarray
    owner: np.ndarray

    def __call__(self, ca: Any, x: Any, expressions: Sequence[Any]) -> Any:
        """The one that holds at x; what others give there, NaN say, has no effect."""
        if len(expressions) == 1:
            return expressions[0]
        number = by_place(ca, x, self.starts, [ca.SX(int(i)) for i in self.owner])
        return sum(ca.if_else(number == i, each, 0) for i, each in enumerate(expressions))


def by_place(ca: Any, x: Any, starts: np.ndarray, expressions: Sequence[Any]) -> Any:
    """The expression of the last start below x, of increasing ones; the first where there is none."""
    out = expressions[-1]
    for start, expression in zip(starts[:0:-1], expressions[-2::-1], strict=True):
        out = ca.if_else(x < float(start), expression, out)
    return out


class Trace:
    """One tracing of a statement: `functions`, `layout`, `sparsity`, and the numbers of conditions."""

    def __init__(self, statement: Statement):
        import casadi as ca

        self._ca, self._said = ca, statement
        n, names = len(statement.unknowns), tuple(statement.parameters)
        self._s, self._x, self._q = ca.SX.sym("s"), ca.SX.sym("x"), ca.SX.sym("p", len(names))
        self._u, self._left, self._right = (ca.SX.sym(k, n) for k in ("u", "u0", "u1"))
        entries = [
            ca.exp(q) if name in statement.log else q for name, q in zip(names, ca.vertsplit(self._q), strict=True)
        ]
        self._p = Named(names, entries)
        with numpy_semantics(ca):
            self._read()
        self.layout = self._layout()
        self._compose()

    def _read(self) -> None:
        """Call all functions of the user, each once."""
        ca, said = self._ca, self._said
        u, left, right = (Named(said.unknowns, ca.vertsplit(v)) for v in (self._u, self._left, self._right))
        inside = Tracer(ca, (self._s, self._u, self._q), (self._s, u, self._p))
        ends = Tracer(ca, (self._left, self._right, self._q), (left, right, self._p))
        here = self._here = Tracer(ca, (self._u, self._q), (u, self._p))
        self._rhs = [inside.column(f, "rhs", said.unknowns) for f in said.rhs]
        self._boundary = ends.column(said.boundary, "boundary")
        self.n_boundary = self._boundary.numel()
        self._places = self._read_places()
        integrals = [inside.column(g, "integrals") for g in said.integrals]
        # every row: (place, or None for all pieces, expression, side)
        self._rows: list[tuple[int | None, Any, str]] = [(None, row, "") for g in integrals for row in ca.vertsplit(g)]
        self.n_integral = len(self._rows)
        self._jumps: dict[int, Any] = {}
        for x in said.inner:
            if self._place_of(x.at) in self._jumps:
                raise ValueError("inner: expected one Inner for each place, got two at the same: put all into one")
            self._jumps[self._place_of(x.at)] = self._jump(here, x)
            conditions = [] if x.conditions is None else ca.vertsplit(ends.column(x.conditions, "conditions"))
            self._rows += [(self._place_of(x.at), row, "both") for row in conditions]
        self.n_inner = len(self._rows) - self.n_integral
        self._identities = None if said.identities is None else here.column(said.identities, "identities")
        self._read_observables({"integral": inside, "end": ends, "inner": here})

    def _read_observables(self, tracers: Mapping[str, Tracer]) -> None:
        """Rows of conditions that observables have the values of parameters, then those of the observables."""
        said = self._said
        columns = {
            key: tracers[seen.kind].column(seen.function, f"observable {key}", (key,))
            for key, seen in said.observables.items()
        }
        for key, value in said.held.items():
            self._append(
                said.observables[key], columns[key] - self._share(said.observables[key]) * getattr(self._p, value)
            )
        self._rows += [(None, self._ca.SX.zeros(1), "")] * said.phases
        self.n_boundary, self.n_integral = self._boundary.numel(), len(self._rows) - self.n_inner
        for key, seen in said.observables.items():
            self._append(seen, columns[key])

    def _append(self, seen: Observable, column: Any) -> None:
        if seen.kind == "end":
            self._boundary = self._ca.vertcat(self._boundary, column)
        else:
            self._rows.append((None if seen.at is None else self._place_of(seen.at), column, seen.side))

    def _share(self, seen: Observable) -> Any:
        """Of a number in the row of an observable: an integral spreads it over the interval."""
        return 1 / (self._places[-1] - self._places[0]) if seen.kind == "integral" else 1

    # -- places -------------------------------------------------------------------------------------------------------

    def _read_places(self) -> list[Any]:
        """Expressions of all places, in their order at the default parameters, ends included."""
        said = self._said
        start, end = (self._expression("interval", at) for at in said.interval)
        found, aliases = list[Any](), dict[Place, int]()
        named = [*(("breakpoints", at) for at in said.breakpoints), *(("inner", at) for at in said.inner_places())]
        for kind, at in named:
            expression = self._expression(kind, at)
            same = (i for i, known in enumerate(found) if self._ca.is_equal(known, expression, SAME_DEPTH))
            aliases[at] = next(same, len(found))
            if aliases[at] == len(found):
                found.append(expression)
        rank = np.argsort(np.argsort(self._numbers(found), kind="stable"))
        self._order = {at: int(rank[i]) + 1 for at, i in aliases.items()}
        laws = {self._order[at] for at in (*said.breakpoints, *(x.at for x in said.inner))}
        self._law = np.cumsum([i in laws for i in range(len(found) + 1)])  # number of the law on each piece
        return [start, *(found[i] for i in np.argsort(rank)), end]

    def _expression(self, field: str, at: Place) -> Any:
        if isinstance(at, str):
            if at not in self._said.parameters:
                raise ValueError(f"{field}: expected a number or one of {', '.join(self._said.parameters)}, got '{at}'")
            return getattr(self._p, at)
        if callable(at):
            return Tracer(self._ca, (self._q,), (self._p,)).column(at, field, (field,))
        return self._ca.SX(float(at))

    def _place_of(self, at: Place) -> int:
        return self._order[at]

    def _numbers(self, expressions: list[Any]) -> np.ndarray:
        """Values at the default parameters."""
        function = self._ca.Function("places", [self._q], [self._ca.vertcat(*expressions)])
        default = [np.log(v) if k in self._said.log else v for k, v in self._said.parameters.items()]
        return np.asarray(function(default)).reshape(-1)

    def _layout(self) -> Layout:
        said, places = self._said, self._numbers(self._places)
        if not (np.isfinite(places).all() and (np.diff(places) > 0).all()):
            shown = ", ".join(f"{value:g}" for value in places)
            raise ValueError(
                f"interval, breakpoints, inner: expected distinct places between the ends of the interval at the "
                f"default parameters, got {shown}"
            )
        if len(self._rhs) not in (1, laws := int(self._law[-1]) + 1):
            raise ValueError(f"rhs: expected one function or {laws}, one per piece, got {len(self._rhs)}")
        inner = [self._place_of(at) for at in said.inner_places()]
        moving = any(not e.is_constant() for e in self._places[1:-1])
        return laid_out(places.tolist(), [i in inner for i in range(len(places))], moving)

    def _jump(self, here: Tracer, x: Inner) -> Any:
        """Jumps (n,) at an inner point."""
        ca, said = self._ca, self._said
        if x.jumps is None:
            return ca.SX.zeros(len(said.unknowns))

        def all_jumps(u: Any, p: Any) -> list[Any]:
            sizes = x.jumps(u, p)  # type: ignore[misc]
            if not isinstance(sizes, Mapping) or set(sizes) - set(said.unknowns):
                got = sorted(sizes) if isinstance(sizes, Mapping) else sizes
                raise ValueError(f"jumps: expected a mapping with some of {', '.join(said.unknowns)}, got {got}")
            return [sizes.get(name, 0.0) for name in said.unknowns]

        column = here.column(all_jumps, "jumps", said.unknowns)
        jumping = [i for i in range(column.numel()) if not column[i].is_zero()]
        if ca.jacobian(column, self._u[jumping]).nnz() if jumping else False:
            names = ", ".join(said.unknowns[i] for i in jumping)
            raise ValueError(
                f"jumps: expected functions of parameters and of unknowns that do not jump there, got one of {names}: "
                "make the jump a free parameter and this law a condition"
            )
        return column

    # -- composition --------------------------------------------------------------------------------------------------

    def _groups(self) -> list[list[int]]:
        """Parts with one expression for all: the pieces of each law, and every inner point by itself."""
        layout = self.layout
        pieces, inner = np.flatnonzero(~layout.is_inner), np.flatnonzero(layout.is_inner)
        law = self._law[layout.places[pieces]] if len(self._rhs) > 1 else np.zeros(len(pieces), dtype=int)
        return [pieces[law == i].tolist() for i in range(len(self._rhs))] + [[i] for i in inner.tolist()]

    def _on_pieces(self, parts: Sequence[int], law: int) -> tuple[Any, Any]:
        """Right-hand side (n,) and densities on the pieces of one law, in the reference coordinate."""
        ca, layout, n = self._ca, self.layout, self._u.numel()
        rows = [row if at is None else ca.SX.zeros(1) for at, row, _ in self._rows]
        both = ca.vertcat(self._rhs[law], *rows)
        if len(layout.weights) == 1 and self._places[0].is_zero() and self._places[1].is_one():
            both = ca.substitute(both, self._s, self._x)
            return both[:n], both[n:]
        places, rates = [], []
        for i in parts:
            start, width, first = float(layout.knots[i]), float(np.diff(layout.knots)[i]), int(layout.places[i])
            length = self._places[first + 1] - self._places[first]
            if not length.is_constant():  # what has no length left has no solution either
                length = ca.if_else(length > 0, length, ca.SX(float("nan")))
            rates.append(length / width)
            places.append(self._places[first] + (self._x - start) * rates[-1])
        place, rate = (by_place(ca, self._x, layout.knots[parts], each) for each in (places, rates))
        both = ca.substitute(both, self._s, place) * rate
        return both[:n], both[n:]

    def _at_inner_point(self, part: int) -> tuple[Any, Any]:
        """The same on the part of an inner point."""
        ca, layout = self._ca, self.layout
        start, width, place = float(layout.knots[part]), float(np.diff(layout.knots)[part]), int(layout.places[part])
        f = self._jumps.get(place, ca.SX.zeros(self._u.numel())) / width
        sides = (self._u - (self._x - start) * f, self._u + (start + width - self._x) * f)
        rows = [
            self._on_sides(row, side, sides) / width if at == place else ca.SX.zeros(1) for at, row, side in self._rows
        ]
        return f, ca.vertcat(*rows) if rows else ca.SX(0, 1)

    def _on_sides(self, row: Any, side: str, sides: tuple[Any, Any]) -> Any:
        if side == "both":
            return self._ca.substitute(row, self._ca.vertcat(self._left, self._right), self._ca.vertcat(*sides))
        return self._ca.substitute(row, self._u, sides[side == "right"])

    def _compose(self) -> None:
        ca, x, u, q = self._ca, self._x, self._u, self._q
        groups, laws = self._groups(), len(self._rhs)
        parts = [self._on_pieces(group, i) if i < laws else self._at_inner_point(group[0])
                 for i, group in enumerate(groups)]  # fmt: skip
        self._owner = np.array([i for part in range(len(self.layout.weights)) for i in range(len(groups))
                                if part in groups[i]])  # fmt: skip
        fields, densities = [f for f, _ in parts], [g for _, g in parts]
        pattern = sum((ca.DM(ca.jacobian(f, u).sparsity(), 1) for f in fields), ca.DM(u.numel(), u.numel())).sparsity()
        self.sparsity: Sparsity = strong_components(u.numel(), *pattern_of(pattern))
        moving = [i for i in range(q.numel()) if any(ca.depends_on(f, q[i]) for f in fields)]
        both = ca.vertcat(self._left, self._right)
        b, same, places = self._boundary, self._identities, ca.vertcat(*self._places)
        self.functions = Traced(
            field=self._switched("field", [x, u, q], [
                [f, _nonzeros(ca, ca.project(ca.jacobian(f, u), pattern)), ca.densify(ca.jacobian(f, q)[:, moving])]
                for f in fields
            ]),
            moving=np.array(moving, dtype=np.int64),
            values=self._switched("values", [x, u, q], [[f] for f in fields]),
            field_second=self._second("field_second", x, fields),
            ends=function_of(ca, "ends", [both, q], [b, *_derivatives(ca, b, both, q)]),
            ends_second=function_of(ca, "ends_second", *second_of(ca, [both, q], b, both, q)),
            densities=self._switched("densities", [x, u, q], [[g, *_derivatives(ca, g, u, q)] for g in densities]),
            densities_second=self._second("densities_second", x, densities),
            identities=None if same is None else function_of(
                ca, "identities", [u, q], [same, *_derivatives(ca, same, u, q)]
            ),
            places=function_of(ca, "places", [q], [places]),
            fixed_places=self._fixed(places),
            parts=tuple((function_of(ca, "f", [x, u, q], [f]), function_of(ca, "g", [x, u, q], [g])) for f, g in parts),
            choice=Choice(self.layout.knots[:-1], self._owner),
        )  # fmt: skip

    def _fixed(self, places: Any) -> np.ndarray | None:
        """Knots and places (K+1, 2), read-only, where no parameter moves them."""
        if not places.is_constant():
            return None
        found = np.column_stack([self.layout.knots, np.array(self._ca.DM(places)).ravel()[self.layout.places]])
        found.setflags(write=False)
        return found

    def _second(self, name: str, x: Any, parts: Sequence[Any]) -> Any:
        found = [second_of(self._ca, [x, self._u, self._q], part, self._u, self._q) for part in parts]
        inputs = found[0][0]
        outputs = [[self._ca.substitute(e, self._ca.vertcat(*more[3:]), self._ca.vertcat(*inputs[3:])) for e in out]
                   for more, out in found]  # fmt: skip
        return self._switched(name, inputs, outputs)

    def _switched(self, name: str, inputs: list[Any], parts: list[list[Any]]) -> Any:
        choice = Choice(self.layout.knots[:-1], self._owner)
        outputs = [choice(self._ca, inputs[0], list(each)) for each in zip(*parts, strict=True)]
        return function_of(self._ca, name, inputs, outputs)


def _derivatives(ca: Any, f: Any, u: Any, p: Any) -> list[Any]:
    return [ca.densify(ca.jacobian(f, u)), ca.densify(ca.jacobian(f, p))]


def _nonzeros(ca: Any, matrix: Any) -> Any:
    entries: Any = matrix.nonzeros()
    return ca.vertcat(*entries) if entries else ca.SX(0, 1)
