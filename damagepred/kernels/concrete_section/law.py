"""The law of a reinforced-concrete section: axial force and moment from mean strain and curvature.

Signs: tension positive, M positive where the bottom is in tension (sagging); strain at a depth z below mid-depth is
strain + curvature z.

**cracked** (Ghali and Favre; EN 1992-1-1, 7.4.3). Of the length of beam that a section stands for, a share zeta is
cracked through (state II: concrete carries no tension, pressure up to f'c; steel yields), the rest is whole (state I:
linear, steel transformed). Both carry the same forces s = (N, M), so their deformations e = (strain, curvature) add up:

    e = (1 - zeta) F s + zeta e2,   s = S(e2),   zeta = max(earlier zeta, 1 - beta / r^2) for r > 1

with F the flexibility of state I, S the forces of state II and r the largest tensile stress of state I over f_ct. Where
the wires cannot carry the tension that cracking concrete releases, r refers to the strength of the wires
(``wires_pull``): the section would break at one crack, so its strength has no peak before. The unknowns are e2: S is
explicit, integrated over the depth in closed form. Where beta < 1, zeta would jump from 0 to 1 - beta as the section
cracks; it rises within ``CRACKING_RAMP`` of r instead, so that forces are continuous.

Each face has its own zeta: cracks in a pressed face are closed and do not count. Where both faces are pulled, the less
pulled face counts in proportion; the same holds for the less pressed face where both are pressed (the two states then
differ only if concrete or steel yields). Once steel has yielded, cracks do not close again, and both faces have the
larger zeta. Concrete pressed beyond f'c is not whole either: its pressure over ``strength_share`` f'c
(assembly/section.py) counts as r, for both faces.

**branson**: E_c I_e with I_e = I_cr + (I_g - I_cr) (M_cr / M)^n at the largest earlier |M| of that sign;
N = E_c A strain.

Inside, curvature and moment are scaled by the depth, so that all four numbers of a stiffness are forces.
"""

from typing import NamedTuple

from damagepred.kernels.concrete_section.state_two import state_two, steel_stress
from damagepred.kernels.jit import kernel, law, rule

CRACKED, BRANSON = 0, 1
TOP, BOTTOM = 0, 1


CRACKING_RAMP = 0.05
"""Range of r above 1 in which cracks form where beta < 1 (1)."""
TOLERANCE = 1e-12
"""Relative error of the deformation (1)."""
MAX_NEWTON_ITERATIONS = 25
"""Iterations for the deformation of state II."""
MAX_BRACKETING_ITERATIONS = 100
"""Iterations for zeta, where Newton's method fails."""


class Wire(NamedTuple):
    """Steel on one face of a section, and the history variables of that face."""

    area: float
    level: float  # depth below the middle over the depth of the section (1)
    plastic: float
    cracked: float  # cracked share zeta


class Section(NamedTuple):
    """One section and its history variables; curvature and moment scaled by the depth."""

    k11: float  # to f22: stiffness and flexibility of state I
    k12: float
    k22: float
    f11: float
    f12: float
    f22: float
    concrete: float
    modulus: float
    crushing: float
    steel: float
    hardening: float
    strength: float
    beta: float
    top: Wire
    bottom: Wire


@rule
def section_response(sections, s, memory, strain, curvature):
    """Forces and tangent (N, M, dN/dstrain, dN/dcurvature, dM/dstrain, dM/dcurvature) of section s.

    The tangent is symmetric and positive while cracks do not grow. While they grow, only its determinant stays positive
    in bending; its symmetric part does if also N <= 0 and beta = 1.
    """
    if sections.law[s] == BRANSON:
        moment, slope = _branson(sections, s, memory, curvature)
        axial = sections.axial_stiffness[s]
        return axial * strain, moment, axial, 0.0, 0.0, slope
    depth = sections.depth[s]
    section, limits = _section(sections, s, memory), _limits(sections, s)
    first, turn = sections.first_cracked[s], curvature * depth
    share, strain2, turn2, axial, moment = _solve_compatibility(section, limits, first, strain, turn)
    if share == 0.0:
        k12 = sections.coupled_stiffness[s]
        return axial, moment * depth, sections.axial_stiffness[s], k12, k12, sections.bending_stiffness[s]
    _, _, t11, t12, t22 = state_two(section, strain2, turn2)
    _, by_axial, by_moment = _share(section, limits, axial, moment)
    tangent = (t11, t12, t22)
    j11, j12, j21, j22 = _jacobian(section, tangent, share, by_axial, by_moment, strain2, turn2, axial, moment)
    determinant = j11 * j22 - j12 * j21
    if not abs(determinant) > 1e-300:  # cracking starts at this strain: use the uncracked slope
        j11, j12, j21, j22 = _jacobian(section, tangent, share, 0.0, 0.0, strain2, turn2, axial, moment)
        determinant = j11 * j22 - j12 * j21
    i11, i12, i21, i22 = j22 / determinant, -j12 / determinant, -j21 / determinant, j11 / determinant
    return (
        axial,
        moment * depth,
        t11 * i11 + t12 * i21,
        (t11 * i12 + t12 * i22) * depth,
        (t12 * i11 + t22 * i21) * depth,
        (t12 * i12 + t22 * i22) * depth * depth,
    )


@rule
def commit_section(sections, s, memory, strain, curvature):
    """Commit the history variables of section s at an equilibrium: cracking and plastic strain of the steel."""
    if sections.law[s] == BRANSON:
        moment, _ = _branson(sections, s, memory, curvature)
        face = BOTTOM if moment > 0.0 else TOP
        memory.cracked[s, face] = max(memory.cracked[s, face], abs(moment))
        return
    section, limits = _section(sections, s, memory), _limits(sections, s)
    first, turn = sections.first_cracked[s], curvature * sections.depth[s]
    share, strain2, turn2, axial, moment = _solve_compatibility(section, limits, first, strain, turn)
    if share == 0.0:
        return
    top, bottom, top_crush, bottom_crush = limits
    beta = section.beta
    crushed = max(
        _cracked_share(top_crush[0] * axial + top_crush[1] * moment, beta)[0],
        _cracked_share(bottom_crush[0] * axial + bottom_crush[1] * moment, beta)[0],
    )
    cracked = memory.cracked[s]
    cracked[TOP] = max(cracked[TOP], crushed, _cracked_share(_cracking_ratio(top, axial, moment)[0], beta)[0])
    cracked[BOTTOM] = max(cracked[BOTTOM], crushed, _cracked_share(_cracking_ratio(bottom, axial, moment)[0], beta)[0])
    _, _, by_top = steel_stress(section, section.top.plastic, strain2 + turn2 * section.top.level)
    _, _, by_bottom = steel_stress(section, section.bottom.plastic, strain2 + turn2 * section.bottom.level)
    if by_top != 0.0 or by_bottom != 0.0:
        memory.plastic[s, TOP] += by_top
        memory.plastic[s, BOTTOM] += by_bottom
        widest = max(cracked[TOP], cracked[BOTTOM])
        cracked[TOP] = widest
        cracked[BOTTOM] = widest


# -- values of one section --------------------------------------------------------------------------------------------


@law
def _section(sections, s, memory):
    """Values of section s."""
    depth, wires, plastic, cracked = sections.depth[s], sections.wires, memory.plastic, memory.cracked
    return Section(
        sections.axial_stiffness[s],
        sections.coupled_stiffness[s] / depth,
        sections.bending_stiffness[s] / (depth * depth),
        sections.flexibility[s, 0],
        sections.flexibility[s, 1],
        sections.flexibility[s, 2],
        sections.concrete_modulus[s] * sections.width[s] * depth,
        sections.concrete_modulus[s],
        sections.crushing_strain[s],
        wires.modulus[s],
        wires.hardening[s],
        wires.strength[s],
        sections.tension_stiffening[s],
        Wire(wires.top_area[s], wires.top_level[s] / depth, plastic[s, TOP], cracked[s, TOP]),
        Wire(wires.bottom_area[s], wires.bottom_level[s] / depth, plastic[s, BOTTOM], cracked[s, BOTTOM]),
    )


@law
def _limits(sections, s):
    """Cracking ratios per N and M / depth: top and bottom in tension (concrete, wires), then both in compression."""
    pull, wires, crush = sections.pull, sections.wires_pull, sections.crush
    return (
        (pull[s, TOP, 0], pull[s, TOP, 1], wires[s, TOP, 0], wires[s, TOP, 1]),
        (pull[s, BOTTOM, 0], pull[s, BOTTOM, 1], wires[s, BOTTOM, 0], wires[s, BOTTOM, 1]),
        (crush[s, TOP, 0], crush[s, TOP, 1]),
        (crush[s, BOTTOM, 0], crush[s, BOTTOM, 1]),
    )


@kernel
def commit_earlier_moment(sections, memory):
    """Crack both faces of all sections by their earlier moment at N = 0."""
    for s in range(sections.interface.size):
        moment = sections.earlier_moment[s]
        if sections.law[s] == BRANSON:
            memory.cracked[s, TOP] = max(memory.cracked[s, TOP], moment)
            memory.cracked[s, BOTTOM] = max(memory.cracked[s, BOTTOM], moment)
            continue
        scaled = moment / sections.depth[s]
        beta = sections.tension_stiffening[s]
        top, bottom, _, _ = _limits(sections, s)
        cracked = memory.cracked[s]
        cracked[TOP] = max(cracked[TOP], _cracked_share(_cracking_ratio(top, 0.0, -scaled)[0], beta)[0])
        cracked[BOTTOM] = max(cracked[BOTTOM], _cracked_share(_cracking_ratio(bottom, 0.0, scaled)[0], beta)[0])


# -- Branson ----------------------------------------------------------------------------------------------------------


@rule
def _branson(sections, s, memory, curvature):
    """Moment (Nm) and its slope (Nm2)."""
    face = BOTTOM if curvature > 0.0 else TOP
    cracked = sections.cracked_second_moment[s, face] * sections.concrete_modulus[s]
    whole = sections.bending_stiffness[s]
    first, n = sections.cracking_moment[s], sections.exponent[s]
    largest = max(memory.cracked[s, face], first)
    bent = abs(curvature)
    secant = cracked + (whole - cracked) * (first / largest) ** n
    if secant * bent <= largest:
        return secant * curvature, secant
    # curvature = M / EI(M) has one root; from below, where it is convex, Newton's steps never pass it
    moment = max(largest, cracked * bent)
    for _ in range(100):
        more = (whole - cracked) * (first / moment) ** n
        step = (bent * (cracked + more) - moment) / (1.0 + bent * n * more / moment)
        moment += step
        if abs(step) <= TOLERANCE * moment:
            break
    more = (whole - cracked) * (first / moment) ** n
    slope = (cracked + more) / (1.0 + bent * n * more / moment)
    return (moment if curvature > 0.0 else -moment), slope


# -- two states -------------------------------------------------------------------------------------------------------


@rule
def _solve_compatibility(section, limits, first, strain, turn):
    """Solution (zeta, e2 as strain and turn, N, M / depth) of the compatibility equation; without e2 if zeta = 0.

    ``first`` (2, 2): e2 as the section cracks by bending, from above and from below.
    """
    axial, moment = section.k11 * strain + section.k12 * turn, section.k12 * strain + section.k22 * turn
    share, by_axial, by_moment = _share(section, limits, axial, moment)
    if share == 0.0:
        return share, 0.0, 0.0, axial, moment
    scale = abs(strain) + abs(turn) + abs(section.top.plastic) + abs(section.bottom.plastic)

    # start from the deformation of the whole section, at first cracking in bending at least from the cracked state
    strain2, turn2 = strain, turn
    if (by_axial != 0.0 or by_moment != 0.0) and abs(strain) < 0.5 * abs(turn):
        face = BOTTOM if turn > 0.0 else TOP
        first_strain, first_turn = first[face, 0], first[face, 1]
        if abs(first_turn) > abs(turn):
            strain2, turn2 = first_strain, first_turn
        else:
            strain2, turn2 = first_strain * turn / first_turn, turn

    # Newton with step halving
    axial, moment, tangent, share, growth, gap1, gap2 = _compatibility_gap(
        section, limits, strain, turn, strain2, turn2
    )
    error = abs(gap1) + abs(gap2)
    for _ in range(MAX_NEWTON_ITERATIONS):
        if error <= TOLERANCE * scale:
            return share, strain2, turn2, axial, moment
        j11, j12, j21, j22 = _jacobian(section, tangent, share, growth[0], growth[1], strain2, turn2, axial, moment)
        determinant = j11 * j22 - j12 * j21
        if not abs(determinant) > 1e-14 * (abs(j11 * j22) + abs(j12 * j21)):
            break
        step1 = (j22 * gap1 - j12 * gap2) / determinant
        step2 = (j11 * gap2 - j21 * gap1) / determinant
        before, start1, start2 = error, strain2, turn2
        for _ in range(8):
            strain2, turn2 = start1 - step1, start2 - step2
            axial, moment, tangent, share, growth, gap1, gap2 = _compatibility_gap(
                section, limits, strain, turn, strain2, turn2
            )
            error = abs(gap1) + abs(gap2)
            if error < before:
                break
            step1 *= 0.5
            step2 *= 0.5
        if not error < before:
            break
    if error <= 1e3 * TOLERANCE * scale:
        return share, strain2, turn2, axial, moment
    return _solve_bracketed(section, limits, strain, turn, scale)


@law
def _compatibility_gap(section, limits, strain, turn, strain2, turn2):
    """N, M / depth, their tangent, zeta and its slopes at e2, and the gap (1 - zeta) F s + zeta e2 - e."""
    f11, f12, f22 = section.f11, section.f12, section.f22
    axial, moment, t11, t12, t22 = state_two(section, strain2, turn2)
    share, by_axial, by_moment = _share(section, limits, axial, moment)
    gap1 = (1.0 - share) * (f11 * axial + f12 * moment) + share * strain2 - strain
    gap2 = (1.0 - share) * (f12 * axial + f22 * moment) + share * turn2 - turn
    return axial, moment, (t11, t12, t22), share, (by_axial, by_moment), gap1, gap2


@rule
def _solve_bracketed(section, limits, strain, turn, scale):
    """Solution by the Illinois variant of regula falsi for zeta; for each zeta, e2 minimises a convex energy."""
    low, high = 0.0, 1.0
    share, strain2, turn2, axial, moment = 1.0, strain, turn, 0.0, 0.0
    excess_low, excess_high, last = 0.0, 0.0, 0
    for trial in range(MAX_BRACKETING_ITERATIONS):
        if trial == 0:
            share = 1.0
        elif trial < 3 or trial % 3 == 0 or excess_low <= excess_high:
            share = 0.5 * (low + high)
        else:
            share = low + (high - low) * excess_low / (excess_low - excess_high)
            if not low < share < high:
                share = 0.5 * (low + high)
        strain2, turn2, axial, moment = _minimum_energy(section, strain, turn, share, strain2, turn2, TOLERANCE * scale)
        excess, _, _ = _share(section, limits, axial, moment)
        excess -= share
        if excess >= 0.0:
            if last == 1:  # Illinois: halve the value at the end that stays
                excess_high *= 0.5
            low, excess_low, last = share, excess, 1
        else:
            if last == -1:
                excess_low *= 0.5
            high, excess_high, last = share, excess, -1
            if trial == 0:
                excess_low = 1.0
        if abs(excess) <= TOLERANCE * share or high - low <= 1e-15 * high:
            break
    return share, strain2, turn2, axial, moment


@rule
def _minimum_energy(section, strain, turn, share, strain2, turn2, tolerance):
    """Solution (e2, N, M / depth) of (1 - zeta) S(e2) + zeta K e2 = K e for zeta > 0: minimum of a convex function."""
    axial, moment, (t11, t12, t22), gradient1, gradient2 = _energy_gradient(
        section, strain, turn, share, strain2, turn2
    )
    for _ in range(100):
        h11 = (1.0 - share) * t11 + share * section.k11
        h12 = (1.0 - share) * t12 + share * section.k12
        h22 = (1.0 - share) * t22 + share * section.k22
        determinant = h11 * h22 - h12 * h12
        step1 = (h12 * gradient2 - h22 * gradient1) / determinant
        step2 = (h12 * gradient1 - h11 * gradient2) / determinant
        slope = gradient1 * step1 + gradient2 * step2
        start1, start2 = strain2, turn2
        for _ in range(30):
            strain2, turn2 = start1 + step1, start2 + step2
            axial, moment, (t11, t12, t22), gradient1, gradient2 = _energy_gradient(
                section, strain, turn, share, strain2, turn2
            )
            if gradient1 * step1 + gradient2 * step2 <= -0.9 * slope:
                break
            step1 *= 0.5
            step2 *= 0.5
        if share * (abs(step1) + abs(step2)) <= 0.1 * tolerance:
            break
    return strain2, turn2, axial, moment


@law
def _energy_gradient(section, strain, turn, share, strain2, turn2):
    """N, M / depth, their tangent, and the gradient (1 - zeta) S(e2) + zeta K e2 - K e."""
    k11, k12, k22 = section.k11, section.k12, section.k22
    aim1, aim2 = k11 * strain + k12 * turn, k12 * strain + k22 * turn
    axial, moment, t11, t12, t22 = state_two(section, strain2, turn2)
    gradient1 = (1.0 - share) * axial + share * (k11 * strain2 + k12 * turn2) - aim1
    gradient2 = (1.0 - share) * moment + share * (k12 * strain2 + k22 * turn2) - aim2
    return axial, moment, (t11, t12, t22), gradient1, gradient2


@law
def _jacobian(section, tangent, share, by_axial, by_moment, strain2, turn2, axial, moment):
    """Jacobian de/de2 = (1 - zeta) F T + zeta + (e2 - F s) dzeta/ds T."""
    f11, f12, f22 = section.f11, section.f12, section.f22
    t11, t12, t22 = tangent
    apart1 = strain2 - f11 * axial - f12 * moment
    apart2 = turn2 - f12 * axial - f22 * moment
    grow1, grow2 = by_axial * t11 + by_moment * t12, by_axial * t12 + by_moment * t22
    whole = 1.0 - share
    return (
        whole * (f11 * t11 + f12 * t12) + share + apart1 * grow1,
        whole * (f11 * t12 + f12 * t22) + apart1 * grow2,
        whole * (f12 * t11 + f22 * t12) + apart2 * grow1,
        whole * (f12 * t12 + f22 * t22) + share + apart2 * grow2,
    )


# -- cracked share zeta -----------------------------------------------------------------------------------------------


@law
def _cracking_ratio(face, axial, moment):
    """Cracking ratio r at a face, and its slopes with N and M / depth."""
    ratio = face[0] * axial + face[1] * moment
    wires = face[2] * axial + face[3] * moment
    if wires > ratio:
        return wires, face[2], face[3]
    return ratio, face[0], face[1]


@law
def _cracked_share(ratio, beta):
    """Cracked share 1 - beta / r^2 and its slope, 0 for r <= 1; a ramp from r = 1 where beta < 1."""
    if ratio <= 1.0:
        return 0.0, 0.0
    rising = (ratio - 1.0) / CRACKING_RAMP
    share = 1.0 - beta / (ratio * ratio)
    if rising < share:
        return rising, 1.0 / CRACKING_RAMP
    return share, 2.0 * beta / (ratio * ratio * ratio)


@rule
def _share(section, limits, axial, moment):
    """Cracked share zeta and its slopes with N and M / depth."""
    on_top, on_bottom, top_crush, bottom_crush = limits
    beta = section.beta
    r_top, top_axial, top_moment = _cracking_ratio(on_top, axial, moment)
    r_bottom, bottom_axial, bottom_moment = _cracking_ratio(on_bottom, axial, moment)
    top, by_top = _cracked_share(r_top, beta)
    bottom, by_bottom = _cracked_share(r_bottom, beta)
    if section.top.cracked >= top:
        top, by_top = section.top.cracked, 0.0
    if section.bottom.cracked >= bottom:
        bottom, by_bottom = section.bottom.cracked, 0.0

    # zeta and its slopes with r_top and r_bottom
    if r_top <= 0.0 and r_bottom <= 0.0:
        total = r_top + r_bottom
        if total == 0.0:
            return max(top, bottom), 0.0, 0.0
        share = (bottom * r_top + top * r_bottom) / total
        to_top, to_bottom = (bottom - share) / total, (top - share) / total
    elif r_bottom >= r_top:
        share, to_top, to_bottom = bottom, 0.0, by_bottom
        if r_top > 0.0 and top > bottom:
            weight = r_top / r_bottom
            share += (top - bottom) * weight
            to_top = by_top * weight + (top - bottom) / r_bottom
            to_bottom += -by_bottom * weight - (top - bottom) * weight / r_bottom
    else:
        share, to_top, to_bottom = top, by_top, 0.0
        if r_bottom > 0.0 and bottom > top:
            weight = r_bottom / r_top
            share += (bottom - top) * weight
            to_bottom = by_bottom * weight + (bottom - top) / r_top
            to_top += -by_top * weight - (bottom - top) * weight / r_top
    by_axial = to_top * top_axial + to_bottom * bottom_axial
    by_moment = to_top * top_moment + to_bottom * bottom_moment
    for to_axial, to_moment in (top_crush, bottom_crush):
        ratio = to_axial * axial + to_moment * moment
        if ratio > 1.0:
            crushed, growing = _cracked_share(ratio, beta)
            if crushed > share:
                share, by_axial, by_moment = crushed, growing * to_axial, growing * to_moment
    return share, by_axial, by_moment
