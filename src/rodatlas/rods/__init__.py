"""Rods and bands: from a physical description to boundary value problems, states and their stability."""

from rodatlas.rods.band import NARROW, Band, bending_ratio, limiting_shear
from rodatlas.rods.carry import Carried, carried
from rodatlas.rods.conjugate_points import IndexResult, index_nodes, morse_index
from rodatlas.rods.contact import Contact, self_contact
from rodatlas.rods.elastic import ElasticRod, anisotropic_rod, elastic_rod
from rodatlas.rods.ends import Ends
from rodatlas.rods.law import LinearLaw, Rested
from rodatlas.rods.loaded import loaded_rod
from rodatlas.rods.model import clamped_band, rod_model
from rodatlas.rods.modes import Mode, critical_mode, critical_modes
from rodatlas.rods.perfectly_anisotropic import from_reduced, reduced_problem, rod_problem, to_reduced
from rodatlas.rods.planar import planar_states
from rodatlas.rods.poses import Clamps, Pose
from rodatlas.rods.reach import state_at
from rodatlas.rods.second_variation import SecondVariationResult, second_variation_index
from rodatlas.rods.section_models import elliptic_rod, given_rod, rectangular_rod, round_rod
from rodatlas.rods.sections import CIRCLE_SECTION, ELLIPSE, RECTANGLE, Section
from rodatlas.rods.stability import index_of
from rodatlas.rods.state import RodState
from rodatlas.rods.symmetry import (
    asymmetry,
    fixes,
    half_twist,
    has_partner,
    is_symmetric,
    is_twisted,
    mirror_angle,
    mirror_shear,
    pair_member,
    plus_member,
    reverse,
    symmetries_at,
)
from rodatlas.rods.twisted import twisted_states
from rodatlas.rods.units import BandUnits, ClampErrors
from rodatlas.rods.width import width_effect

__all__ = [
    "CIRCLE_SECTION", "ELLIPSE", "NARROW", "RECTANGLE", "Band", "BandUnits", "Carried", "ClampErrors",
    "Clamps", "Contact", "ElasticRod", "Ends", "IndexResult", "LinearLaw", "Mode", "Pose", "Rested", "RodState",
    "SecondVariationResult", "Section", "anisotropic_rod", "asymmetry", "bending_ratio", "carried", "clamped_band",
    "critical_mode", "critical_modes", "elastic_rod", "elliptic_rod", "fixes", "from_reduced", "given_rod",
    "half_twist", "has_partner", "index_nodes", "index_of", "is_symmetric", "is_twisted", "limiting_shear",
    "loaded_rod", "mirror_angle", "mirror_shear", "morse_index", "pair_member", "planar_states", "plus_member",
    "rectangular_rod", "reduced_problem", "reverse", "rod_model", "rod_problem", "round_rod",
    "second_variation_index", "self_contact", "state_at", "symmetries_at", "to_reduced", "twisted_states",
    "width_effect",
]  # fmt: skip
