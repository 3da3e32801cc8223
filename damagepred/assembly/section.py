"""From a reinforced-concrete footing to the values that the law of its sections needs."""

from __future__ import annotations

from dataclasses import dataclass
from typing import NamedTuple

import numpy as np
from numpy.typing import ArrayLike

from damagepred.arrays import FloatArray, IntArray
from damagepred.errors import InputError
from damagepred.kernels.concrete_section.law import BRANSON, CRACKED, commit_earlier_moment
from damagepred.kernels.concrete_section.moment_curvature import moment_curvature_diagram
from damagepred.scene import Footing
from damagepred.scene.concrete import ReinforcedConcrete


@dataclass(frozen=True)
class SectionOptions:
    """Options of the law of cracked sections.

    Attributes
    ----------
    strength_share : float
        Share of the strength of wires and of concrete in compression that the cracked state may use at first cracking.
    minimum_reinforcement : float
        Least area of the top wires over that of the concrete: without wires a face has no cracked state.
    """

    strength_share: float = 0.9
    minimum_reinforcement: float = 1e-4


class Sections(NamedTuple):
    """Sections of a reinforced-concrete beam, s of them; each is an interface between two of its segments.

    Signs as in kernels/concrete_section/law.py. Levels are depths below mid-depth.

    Attributes
    ----------
    interface : array of int (s,)
        Number of the interface in the model.
    length : array (s,)
        Length of beam it stands for (m): opening = strain x length, turn = curvature x length.
    law : array of int (s,)
        CRACKED or BRANSON of kernels/concrete_section/law.py.
    width, depth : array (s,)
        Of the concrete (m).
    concrete_modulus, tensile_strength, crushing_strain : array (s,)
        E_c and f_ct in bending (Pa), f'c / E_c (1).
    steel_modulus, steel_strength, hardening_modulus : array (s,)
        E_s, yield strength, and stress per plastic strain after yield (Pa).
    top_area, bottom_area, top_level, bottom_level : array (s,)
        Area (m2) and level (m) of the wires; the level of the top ones is negative.
    tension_stiffening : array (s,)
        beta (1).
    axial_stiffness, coupled_stiffness, bending_stiffness : array (s,)
        Of the uncracked section about mid-depth (N, Nm, Nm2): with its steel for "cracked", of concrete alone for
        "branson". N = axial x strain + coupled x curvature, M = coupled x strain + bending x curvature.
    flexibility : array (s, 3)
        Inverse of that stiffness with moment / depth and curvature x depth: f11, f12, f22 (1/N).
    pull, wires_pull : array (s, 2, 2)
        Cracking of top and bottom: r for each N of axial force, and of moment / depth (1/N), by the tensile strength of
        concrete and by ``strength_share`` of what the wires hold.
    crush : array (s, 2, 2)
        Likewise its pressure over ``strength_share`` f'c (1/N).
    first_cracked : array (s, 2, 2)
        Strain at mid-depth and curvature x depth of the cracked state at the moment that cracks top and bottom, N = 0.
    cracked_second_moment : array (s, 2)
        I_cr, with the top and with the bottom in tension, in terms of concrete (m4); at most I_g.
    cracking_moment : array (s,)
        M_cr = f_ct I_g / (depth / 2) (Nm), Branson's.
    exponent : array (s,)
        Branson's (1).
    earlier_moment : array (s,)
        By which they have been bent before, either way (Nm).
    """

    interface: IntArray
    length: FloatArray
    law: IntArray
    width: FloatArray
    depth: FloatArray
    concrete_modulus: FloatArray
    tensile_strength: FloatArray
    crushing_strain: FloatArray
    steel_modulus: FloatArray
    steel_strength: FloatArray
    hardening_modulus: FloatArray
    top_area: FloatArray
    bottom_area: FloatArray
    top_level: FloatArray
    bottom_level: FloatArray
    tension_stiffening: FloatArray
    axial_stiffness: FloatArray
    coupled_stiffness: FloatArray
    bending_stiffness: FloatArray
    flexibility: FloatArray
    pull: FloatArray
    wires_pull: FloatArray
    crush: FloatArray
    first_cracked: FloatArray
    cracked_second_moment: FloatArray
    cracking_moment: FloatArray
    exponent: FloatArray
    earlier_moment: FloatArray


class SectionMemory(NamedTuple):
    """What sections went through, for top (0) and bottom (1).

    Attributes
    ----------
    cracked : array (s, 2)
        "cracked": zeta, the share of the length that is cracked from that face. "branson": the largest moment that
        pulled at that face (Nm).
    plastic : array (s, 2)
        Plastic strain of the wires (1), stretched positive.
    """

    cracked: FloatArray
    plastic: FloatArray

    @classmethod
    def at_first(cls, sections: Sections) -> SectionMemory:
        """Return the history of sections after their earlier moment, either way."""
        memory = cls.fresh(len(sections.interface))
        commit_earlier_moment(sections, memory)
        return memory

    @classmethod
    def fresh(cls, number: int) -> SectionMemory:
        """Return the history of uncracked sections."""
        return cls(np.zeros((number, 2)), np.zeros((number, 2)))

    def copy(self) -> SectionMemory:
        """Return a copy that may be changed."""
        return SectionMemory(self.cracked.copy(), self.plastic.copy())


class SecondMoments(NamedTuple):
    """Second moments of area in terms of concrete (m4): of concrete alone, and cracked under sagging and hogging."""

    gross: float
    sagging: float
    hogging: float


def concrete_sections(
    interface: IntArray, length: ArrayLike, footing: Footing, options: SectionOptions = SectionOptions()
) -> Sections:
    """Return the sections of a reinforced-concrete footing.

    Parameters
    ----------
    interface : array of int (s,)
        Numbers of their interfaces in the model.
    length : float or array (s,)
        Length of beam each stands for (m).
    footing : Footing
        With ``concrete``.
    options : SectionOptions
        Options of the law.

    Raises
    ------
    InputError
        If there is no concrete, or its wires are not below (above) mid-depth.
    """
    concrete = _concrete(footing)
    number = len(interface)
    width, depth = footing.width, footing.depth
    modulus, steel = concrete.concrete_modulus, concrete.steel_modulus
    (bottom_area, low), (top_area, high) = _wires(footing, concrete)
    top_area = max(top_area, options.minimum_reinforcement * width * depth)
    gross = _second_moments(footing)
    more = steel - modulus if concrete.law == "cracked" else 0.0
    stiffness = np.array(
        (
            (modulus * width * depth + more * (bottom_area + top_area), more * (bottom_area * low + top_area * high)),
            (0.0, modulus * gross.gross + more * (bottom_area * low**2 + top_area * high**2)),
        )
    )
    stiffness[1, 0] = stiffness[0, 1]
    scale = np.array((1.0, depth))
    flexibility = np.linalg.inv(stiffness / np.outer(scale, scale))
    faces = np.array(((1.0, -0.5), (1.0, 0.5)))
    wires = (
        concrete.steel_strength
        * options.strength_share
        * np.array(_wires_hold(width, depth, steel / modulus, bottom_area, low, top_area, high))
    )
    pull = modulus / concrete.flexural_strength * faces @ flexibility

    def first(face: int) -> tuple[float, float]:
        """Return strain and curvature x depth of the cracked state, at the moment that cracks a face and N = 0."""
        side, second = (-1.0, gross.hogging) if face == 0 else (1.0, gross.sagging)
        layers = ((bottom_area, depth / 2.0 + side * low), (top_area, depth / 2.0 + side * high))
        axis = _neutral_axis(width, steel / modulus, layers) - depth / 2.0
        moment = side * depth / max(side * pull[face, 1], side / wires[face, 1])
        curvature = moment / (modulus * second)
        return -side * axis * curvature, curvature * depth

    values = {
        "law": CRACKED if concrete.law == "cracked" else BRANSON,
        "width": width,
        "depth": depth,
        "concrete_modulus": modulus,
        "tensile_strength": concrete.flexural_strength,
        "crushing_strain": concrete.compressive_strength / modulus,
        "steel_modulus": steel,
        "steel_strength": concrete.steel_strength,
        "hardening_modulus": steel * concrete.hardening / (1.0 - concrete.hardening),
        "top_area": top_area,
        "bottom_area": bottom_area,
        "top_level": high,
        "bottom_level": low,
        "tension_stiffening": concrete.tension_stiffening,
        "axial_stiffness": stiffness[0, 0],
        "coupled_stiffness": stiffness[0, 1],
        "bending_stiffness": stiffness[1, 1],
        "flexibility": flexibility[np.triu_indices(2)],
        "pull": pull,
        "wires_pull": 1.0 / wires,
        "crush": -modulus / (options.strength_share * concrete.compressive_strength) * faces @ flexibility,
        "first_cracked": np.array([first(0), first(1)]),
        "cracked_second_moment": (min(gross.hogging, gross.gross), min(gross.sagging, gross.gross)),
        "cracking_moment": concrete.flexural_strength * gross.gross / (depth / 2.0),
        "exponent": concrete.branson_exponent,
        "earlier_moment": concrete.earlier_moment,
    }
    columns = {name: np.tile(value, (number, *[1] * np.ndim(value))) for name, value in values.items()}
    return Sections(
        interface=np.asarray(interface, np.int64),
        length=np.array(np.broadcast_to(np.asarray(length, float), number)),
        **columns,
    )


def _second_moments(footing: Footing) -> SecondMoments:
    """Return the second moments of area of a footing, gross and cracked (N = 0, elastic steel)."""
    concrete = _concrete(footing)
    half, ratio = footing.depth / 2.0, concrete.steel_modulus / concrete.concrete_modulus
    (bottom_area, low), (top_area, high) = _wires(footing, concrete)
    return SecondMoments(
        gross=footing.width * footing.depth**3 / 12.0,
        sagging=_cracked_second_moment(footing.width, ratio, ((bottom_area, half + low), (top_area, half + high))),
        hogging=_cracked_second_moment(footing.width, ratio, ((bottom_area, half - low), (top_area, half - high))),
    )


def cracking_moment(footing: Footing, axial_force: float = 0.0, hogging: bool = False) -> float:
    """Return the moment at which a footing cracks (Nm, positive), from below or, hogging, from above.

    For law "cracked" with the steel, at most ``strength_share`` of the wires' moment; for "branson" of the concrete
    alone, whatever N. 0 if it cracks without a moment.

    Parameters
    ----------
    footing : Footing
        With ``concrete``.
    axial_force : float
        N (N), at mid-depth.
    hogging : bool
        Whether the top is pulled.
    """
    sections = concrete_sections(np.zeros(1, np.int64), 1.0, footing)
    if sections.law[0] == BRANSON:
        return float(sections.cracking_moment[0])
    face, side = (0, -1.0) if hogging else (1, 1.0)
    (by_axial, by_moment), wires = sections.pull[0, face], sections.wires_pull[0, face]
    moments = [side * (1.0 - by[0] * axial_force) / by[1] for by in ((by_axial, by_moment), wires)]
    return float(max(0.0, min(moments)) * footing.depth)


def moment_curvature(footing: Footing, curvature: ArrayLike, axial_force: float = 0.0) -> FloatArray:
    """Return the moments (Nm, sagging positive) of a section bent by one curvature after the other.

    Parameters
    ----------
    footing : Footing
        With ``concrete``.
    curvature : array (k,)
        Sagging (1/m), in the order in which it happens.
    axial_force : float
        N (N) at mid-depth, pull positive. It must not be more than the wires can carry.
    """
    path = np.ascontiguousarray(np.atleast_1d(curvature), dtype=float)
    strains, moments = np.zeros_like(path), np.zeros_like(path)
    sections = concrete_sections(np.zeros(1, np.int64), 1.0, footing)
    moment_curvature_diagram(sections, SectionMemory.at_first(sections), path, float(axial_force), strains, moments)
    return moments


def _concrete(footing: Footing) -> ReinforcedConcrete:
    concrete = footing.concrete
    if concrete is None:
        raise InputError("[footing] has no concrete: a cracked section needs a table [footing.concrete].")
    return concrete


def _wires(footing: Footing, concrete: ReinforcedConcrete) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return (area, level) of the bottom and of the top wires."""
    (bottom, low), (top, high) = concrete.bottom_wires, concrete.top_wires
    half = footing.depth / 2.0
    if concrete.cover + max(low, high) > half:
        raise InputError(
            f"[footing.concrete] cover = {concrete.cover:g}: puts the wires above mid-depth of the footing, "
            f"depth = {footing.depth:g} m; make the cover smaller or the footing deeper."
        )
    return (bottom, half - concrete.cover - low / 2.0), (top, -(half - concrete.cover - high / 2.0))


def _wires_hold(
    width: float, depth: float, ratio: float, bottom: float, low: float, top: float, high: float
) -> tuple[tuple[float, float], tuple[float, float]]:
    """Return N (m2) at M = 0 and M / depth (m2) at N = 0 for each Pa in the top wires, and in the bottom ones.

    Cracked, concrete carrying no tension. Between the two, forces are linear; that is on the safe side.
    """
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
    """Return I_cr, with the steel (area, depth below the pressed face) in terms of concrete."""
    x = _neutral_axis(width, ratio, layers)
    steel = sum((ratio - (d < x)) * area * (d - x) ** 2 for area, d in layers)
    return float(width * x**3 / 3.0 + steel)


def _neutral_axis(width: float, ratio: float, layers: tuple[tuple[float, float], ...]) -> float:
    """Return its depth x below the pressed face: width x^2 / 2 = sum of n A (d - x), n - 1 for steel in concrete."""
    layers = tuple(sorted(layers, key=lambda layer: layer[1]))
    x = 0.0
    for pressed in range(len(layers) + 1):
        weights = [(ratio - (i < pressed)) * area for i, (area, _) in enumerate(layers)]
        total, first = sum(weights), sum(w * d for w, (_, d) in zip(weights, layers))
        x = float(np.sqrt(total**2 + 2.0 * width * first) - total) / width
        if pressed == len(layers) or x <= layers[pressed][1]:
            break
    return x
