"""From a reinforced-concrete footing to the values that the law of its sections needs."""

from __future__ import annotations

from typing import Any, NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from damagepred.arrays import FloatArray, IntArray
from damagepred.errors import InputError
from damagepred.kernels.concrete_section.law import BRANSON, CRACKED, commit_earlier_moment
from damagepred.kernels.concrete_section.structures import Sections, Wires
from damagepred.scene import Footing
from damagepred.scene.concrete import ReinforcedConcrete

USABLE_STRENGTH = 0.9
"""Share of the strength of wires and of concrete in compression that the cracked state may use at first cracking."""
MINIMUM_REINFORCEMENT = 1e-4  # least area of the top wires over the concrete's: without, no cracked state


class SectionMemory(NamedTuple):
    """History of sections, for top (0) and bottom (1)."""

    # (s, 2): "cracked": zeta, share of the length cracked from that face; "branson": largest moment that pulled
    # at that face (Nm)
    cracked: FloatArray
    plastic: FloatArray  # (s, 2): plastic strain of the wires (1), tension positive

    @classmethod
    def at_first(cls, sections: Sections) -> SectionMemory:
        """History of sections after their earlier moment, in both directions."""
        memory = cls.fresh(len(sections.interface))
        commit_earlier_moment(sections, memory)
        return memory

    @classmethod
    def fresh(cls, number: int) -> SectionMemory:
        """History of uncracked sections."""
        return cls(np.zeros((number, 2)), np.zeros((number, 2)))

    def copy(self) -> SectionMemory:
        """Independent copy."""
        return SectionMemory(self.cracked.copy(), self.plastic.copy())


class SecondMoments(NamedTuple):
    """Second moments of area in terms of concrete (m4): of concrete alone, and cracked under sagging and hogging."""

    gross: float
    sagging: float
    hogging: float


def concrete_sections(interface: IntArray, length: ArrayLike, footing: Footing) -> Sections:
    """Sections (s,) of a reinforced-concrete footing, by their interfaces and the length of beam of each (m)."""
    concrete = _concrete(footing)
    number = len(interface)
    width, depth = footing.width, footing.depth
    modulus, steel = concrete.concrete_modulus, concrete.steel_modulus
    (bottom_area, low), (top_area, high) = _wires(footing, concrete)
    top_area = max(top_area, MINIMUM_REINFORCEMENT * width * depth)
    gross = _second_moments(footing)
    more = steel - modulus if concrete.law == "cracked" else 0.0
    axial = modulus * width * depth + more * (bottom_area + top_area)
    coupled = more * (bottom_area * low + top_area * high)
    bending = modulus * gross.gross + more * (bottom_area * low**2 + top_area * high**2)
    stiffness = np.array(((axial, coupled), (coupled, bending)))
    scale = np.array((1.0, depth))
    flexibility = np.linalg.inv(stiffness / np.outer(scale, scale))
    faces = np.array(((1.0, -0.5), (1.0, 0.5)))
    layers = bottom_area, low, top_area, high
    wires = np.array(_wire_strength(width, depth, steel / modulus, *layers))
    wires = concrete.steel_strength * USABLE_STRENGTH * wires
    pull = modulus / concrete.flexural_strength * faces @ flexibility

    def first(face: int) -> tuple[float, float]:
        """Strain and curvature x depth of the cracked state, at the moment that cracks a face and N = 0."""
        side, second = (-1.0, gross.hogging) if face == 0 else (1.0, gross.sagging)
        layers = ((bottom_area, depth / 2.0 + side * low), (top_area, depth / 2.0 + side * high))
        axis = _neutral_axis(width, steel / modulus, layers) - depth / 2.0
        moment = side * depth / max(side * pull[face, 1], side / wires[face, 1])
        curvature = moment / (modulus * second)
        return -side * axis * curvature, curvature * depth

    values: dict[str, Any] = {
        "law": CRACKED if concrete.law == "cracked" else BRANSON,
        "width": width,
        "depth": depth,
        "concrete_modulus": modulus,
        "crushing_strain": concrete.compressive_strength / modulus,
        "tension_stiffening": concrete.tension_stiffening,
        "axial_stiffness": axial,
        "coupled_stiffness": coupled,
        "bending_stiffness": bending,
        "flexibility": flexibility[np.triu_indices(2)],
        "pull": pull,
        "wires_pull": 1.0 / wires,
        "crush": -modulus / (USABLE_STRENGTH * concrete.compressive_strength) * faces @ flexibility,
        "first_cracked": np.array([first(0), first(1)]),
        "cracked_second_moment": (min(gross.hogging, gross.gross), min(gross.sagging, gross.gross)),
        "cracking_moment": concrete.flexural_strength * gross.gross / (depth / 2.0),
        "exponent": concrete.branson_exponent,
        "earlier_moment": concrete.earlier_moment,
    }
    of_wires = {
        "modulus": steel,
        "strength": concrete.steel_strength,
        "hardening": steel * concrete.hardening / (1.0 - concrete.hardening),
        "top_area": top_area,
        "bottom_area": bottom_area,
        "top_level": high,
        "bottom_level": low,
    }
    columns = {name: np.tile(value, (number, *[1] * np.ndim(value))) for name, value in values.items()}
    return Sections(
        interface=np.asarray(interface, np.int64),
        length=np.array(np.broadcast_to(np.asarray(length, float), number)),
        wires=Wires(**{name: np.full(number, value) for name, value in of_wires.items()}),
        **columns,
    )


def _second_moments(footing: Footing) -> SecondMoments:
    """Second moments of area of a footing, gross and cracked (N = 0, elastic steel)."""
    concrete = _concrete(footing)
    half, ratio = footing.depth / 2.0, concrete.steel_modulus / concrete.concrete_modulus
    (bottom_area, low), (top_area, high) = _wires(footing, concrete)
    return SecondMoments(
        gross=footing.width * footing.depth**3 / 12.0,
        sagging=_cracked_second_moment(footing.width, ratio, ((bottom_area, half + low), (top_area, half + high))),
        hogging=_cracked_second_moment(footing.width, ratio, ((bottom_area, half - low), (top_area, half - high))),
    )


def _concrete(footing: Footing) -> ReinforcedConcrete:
    concrete = footing.concrete
    if concrete is None:
        raise InputError("[footing] has no concrete: a cracked section needs a table [footing.concrete].")
    return concrete


def _wires(footing: Footing, concrete: ReinforcedConcrete) -> tuple[tuple[float, float], tuple[float, float]]:
    """(area, level) of the bottom and of the top wires."""
    (bottom, low), (top, high) = concrete.bottom_wires, concrete.top_wires
    half = footing.depth / 2.0
    if concrete.cover + max(low, high) > half:
        raise InputError(
            f"[footing.concrete] cover = {concrete.cover:g}: puts the wires above mid-depth of the footing, "
            f"depth = {footing.depth:g} m; make the cover smaller or the footing deeper."
        )
    return (bottom, half - concrete.cover - low / 2.0), (top, -(half - concrete.cover - high / 2.0))


def _wire_strength(
    width: float, depth: float, ratio: float, bottom: float, low: float, top: float, high: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """N (m2) at M = 0 and M / depth (m2) at N = 0 per Pa in the top and in the bottom wires of a cracked section."""
    half, both = depth / 2.0, low - high

    def bending(area: float, level: float, other: float, beyond: float) -> float:
        layers = ((area, half + level), (other, half + beyond))
        x = _neutral_axis(width, ratio, layers)
        second = _cracked_second_moment(width, ratio, layers)
        return second / (ratio * (half + level - x)) / depth

    return (
        (top * both / low, -bending(top, -high, bottom, -low)),
        (-bottom * both / high, bending(bottom, low, top, high)),
    )


def _cracked_second_moment(width: float, ratio: float, layers: tuple[tuple[float, float], ...]) -> float:
    """I_cr, with the steel (area, depth below the compressed face) in terms of concrete."""
    x = _neutral_axis(width, ratio, layers)
    steel = sum((ratio - (d < x)) * area * (d - x) ** 2 for area, d in layers)
    return float(width * x**3 / 3.0 + steel)


def _neutral_axis(width: float, ratio: float, layers: tuple[tuple[float, float], ...]) -> float:
    """Depth x below the compressed face: width x^2 / 2 = sum of n A (d - x), n - 1 for steel in compression."""
    layers = tuple(sorted(layers, key=lambda layer: layer[1]))
    x = 0.0
    for pressed in range(len(layers) + 1):
        weights = [(ratio - (i < pressed)) * area for i, (area, _) in enumerate(layers)]
        total, first = sum(weights), sum(w * d for w, (_, d) in zip(weights, layers))
        x = float(np.sqrt(total**2 + 2.0 * width * first) - total) / width
        if pressed == len(layers) or x <= layers[pressed][1]:
            break
    return x
