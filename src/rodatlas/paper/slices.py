"""Height against shear at one clamp angle, with renderings of the stable states: figures 3 to 16 of the paper."""

from __future__ import annotations

from typing import TYPE_CHECKING

from rodatlas.paper.drawn import Drawn, Number

if TYPE_CHECKING:
    from rodatlas.atlas import Slice
    from rodatlas.paper.sources import Sources

# (state, 'low' or 'high', angle in degrees) -> key of its end's shear in the table of known numbers
KNOWN_ENDS = {
    ("U", "high", 0.0): "pitchfork-4-at-0",
    ("uUu", "low", 0.0): "pitchfork-11-at-0",
    ("S+-", "low", 0.0): "S-born-at-0",
    ("U", "high", 15.0): "pitchfork-4-at-15",
    ("uUu", "low", 15.0): "pitchfork-11-at-15",
    ("US+-", "high", 55.0): "US-turns-at-55",
}
KNOWN_PLANAR = {
    ("U", "height", 0.0): "U-height-0",
    ("U", "energy", 0.0): "U-energy-0",
    ("U", "height", 15.0): "U-height-15",
    ("U", "energy", 15.0): "U-energy-15",
    ("TU+-", "height", 15.0): "TU-height-15",
    ("TU+-", "energy", 15.0): "TU-energy-15",
}


def draw(sources: Sources, angle_deg: float, shear_max: float | None = None) -> Drawn:
    """The slice with the band in each named state."""
    from rodatlas.plot import draw_slice_figure

    found = sources.slice_at(angle_deg, shear_max)
    names = ", ".join(dict.fromkeys(s.name for s in found.states))
    caption = (
        f"Equilibria at {angle_deg:g} degrees: height against shear, {len(found.branches)} branches. Stable: {names}. "
        "Solid curves are stable, which the paper infers and we compute."
    )
    return Drawn(draw_slice_figure(found), caption, numbers_of(found), tuple(found.warnings))


def numbers_of(found: Slice) -> tuple[Number, ...]:
    """Shear at which each stable state begins and ends, and height and energy of those that exist without shear."""
    angle = found.settings.setting["angle"]
    numbers = []
    for state in found.states:
        for side, end in (("low", state.low), ("high", state.high)):
            if end.kind != "range":
                what = f"shear at which {state.name} {'begins' if side == 'low' else 'ends'} ({end.text})"
                numbers.append(Number(what, end.value, "L", KNOWN_ENDS.get((state.name, side, angle), "")))
    return (*numbers, *_planar_numbers(found))


def _planar_numbers(found: Slice) -> list[Number]:
    """Height and energy at dD = 0, of the states for which they are known from elsewhere."""
    from rodatlas.atlas.slices.states.coexisting import solve_state

    numbers = []
    for (name, quantity, angle), key in KNOWN_PLANAR.items():
        state = found.state(name, 0.0) if angle == found.settings.setting["angle"] else None
        solution = solve_state(state, 0.0, found.settings) if state is not None else None
        if solution is not None:
            unit = "L" if quantity == "height" else "GJ/L"
            numbers.append(Number(f"{quantity} of {name.removesuffix('-')} at dD = 0", solution[quantity], unit, key))
    return numbers
