"""The band in each of its named states: figure 2 of the paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rodatlas.paper.drawn import Drawn, Number
from rodatlas.paper.names.yu_hanna import COLORS

if TYPE_CHECKING:
    from rodatlas.atlas import Slice, State
    from rodatlas.continuation import Solution
    from rodatlas.paper.sources import Sources

ANGLE_DEG = 15.0
WIDTH = 1.0 / 40.0  # the narrow band of the paper, 1/80, would be a line
COLUMNS = 5


def draw(sources: Sources) -> Drawn:
    """Renderings of all states at 15 degrees, and of S at 0 degrees, where alone it exists."""
    from rodatlas.plot.look.style import color_of
    from rodatlas.plot.shapes.gallery import Item, draw_gallery

    items = []
    for found, wanted in ((sources.slice_at(ANGLE_DEG), None), (sources.slice_at(0.0), "S+-")):
        for state in one_of_each(found):
            if wanted in (None, state.name):
                at = "" if wanted is None else rf"$\psi_0={found.settings.setting['angle']:g}^\circ$, "
                color = color_of(state.name, COLORS)
                items += [
                    Item(s, name, color, rf"{at}$\Delta D={s['dD']:.2f}$") for name, s in members(state, found).items()
                ]  # fmt: skip
    foot = (
        rf"$\psi_0={ANGLE_DEG:g}^\circ$ where not said; $\Delta L=0.5\,L$. Bands are drawn $L/{1 / WIDTH:.0f}$ wide. "
        r"A state − is the reversal, $s \to 1-s$, of +."
    )
    figure = draw_gallery(items, COLUMNS, WIDTH, foot=foot)
    at_angle = [item for item in items if "psi" not in item.note]
    caption = f"The {len(at_angle)} stable states of a narrow band at {ANGLE_DEG:g} degrees, and S± at 0 degrees."
    return Drawn(figure, caption, (Number("stable states at 15 deg", float(len(at_angle)), "", "thirteen-states"),))


def one_of_each(found: Slice) -> list[State]:
    """For each name the state with the longest range of shear."""
    longest: dict[str, State] = {}
    for state in found.states:
        known = longest.get(state.name)
        if known is None or state.span[1] - state.span[0] > known.span[1] - known.span[0]:
            longest[state.name] = state
    return list(longest.values())


def members(state: State, found: Slice) -> dict[str, Solution]:
    """The state in the middle of the part of its range where dD >= 0, rounded; of a pair both members."""
    from rodatlas.atlas.slices.states.coexisting import solve_state
    from rodatlas.rods import plus_member, reverse

    low, high = state.span
    middle = 0.5 * (max(low, 0.0) + high)
    rounded = round(middle, 2)
    solution = solve_state(state, rounded if low < rounded < high else middle, found.settings)
    if solution is None:
        raise ValueError(f"slice: expected {state.name} to be solved at shear {rounded:g}, which did not converge")
    if not state.pair:
        return {state.name: solution}
    plus, name = plus_member(solution), state.name.removesuffix("+-")
    return {f"{name}+": plus, f"{name}-": reverse(plus)}
