"""The law of a reinforced-concrete section: axial force and moment from mean strain and curvature.

Signs: tension positive, M positive where the bottom is in tension (sagging); strain at a depth z below mid-depth is
strain + curvature z.

**cracked** (Ghali and Favre; EN 1992-1-1, 7.4.3). Of the length of beam that a section stands for, a share zeta is
cracked through (state II: concrete carries no tension, pressure up to f'c; steel yields), the rest is whole (state I:
linear, steel transformed). Both carry the same forces s = (N, M), so their deformations e = (strain, curvature) add up:

    e = (1 - zeta) F s + zeta e2,   s = S(e2),   zeta = max(what it was, 1 - beta / r^2) for r > 1

with F the flexibility of state I, S the forces of state II and r the largest tensile stress of state I over f_ct. Where
the wires could not hold what the concrete lets go of, r counts from what they can hold (``wires_pull``): the section
would break at one crack, and its strength is then that of the wires alone, without the peak before. The unknowns are
e2: S is explicit, integrated over the depth in closed form. Where beta < 1, zeta would jump from 0 to 1 - beta as the
section cracks; it rises there within ``RISE`` of r, so that forces are continuous.

Cracks from below and from above are remembered apart: those whose face is pressed are closed and do not count. In
between, where both faces are pulled, the less pulled one counts in proportion, and so does the less pressed one where
both are pressed (there the two states differ only if concrete or steel yield). Once steel has yielded, cracks do not
close again, and both faces count as cracked alike. Concrete that is not cracked but pressed beyond f'c is no longer
whole either: its pressure over ``HELD`` f'c (assembly/section.py) counts as r does, for both faces.

**branson**: E_c I_e with I_e = I_cr + (I_g - I_cr) (M_cr / M)^n at the largest |M| of that sign so far;
N = E_c A strain.

Inside, curvature and moment are scaled by the depth, so that all four numbers of a stiffness are forces.
"""

from typing import NamedTuple

from damagepred.kernels.jit import kernel, law, rule

CRACKED, BRANSON = 0, 1
TOP, BOTTOM = 0, 1

RISE = 0.05
"""Share of the cracking stress above it within which cracks form where beta < 1."""
CLOSE = 1e-12
"""Largest error of the deformation, relative to it."""
MOST_STEPS, MOST_TRIALS = 25, 100


class Section(NamedTuple):
    """What the two states need of one section and its memory; curvature and moment scaled by the depth."""

    k11: float
    k12: float
    k22: float
    f11: float
    f12: float
    f22: float
    concrete: float
    modulus: float
    crushing: float
    steel: float
    harder: float
    strength: float
    beta: float
    top_area: float
    top_level: float
    top_plastic: float
    top_cracked: float
    bottom_area: float
    bottom_level: float
    bottom_plastic: float
    bottom_cracked: float


@rule
def section_response(sections, s, memory, strain, curvature):
    """Return (N, M, dN/dstrain, dN/dcurvature, dM/dstrain, dM/dcurvature) of section s; no history variable changes.

    Tension stiffening by Ghali and Favre (EN 1992-1-1, 7.4.3), or Branson's effective second moment of area.

    The slopes are symmetric and positive while cracks do not grow. While they do, they are not symmetric. Their
    symmetric part stays positive in bending by N <= 0 with beta = 1, but need not where the section is pulled or
    beta < 1; their determinant stays positive in bending.

    Parameters
    ----------
    sections : Sections
        Arrays (s,), see assembly/section.py.
    s : int
        Which of them.
    memory : SectionMemory
        What it went through, up to the last equilibrium.
    strain, curvature : float
        At mid-depth (1) and sagging (1/m).
    """
    if sections.law[s] == BRANSON:
        moment, slope = _branson(sections, s, memory, curvature)
        axial = sections.axial_stiffness[s]
        return axial * strain, moment, axial, 0.0, 0.0, slope
    depth = sections.depth[s]
    section, limits = _section(sections, s, memory), _limits(sections, s)
    share, strain2, turn2, axial, moment = _shared(section, limits, _start(sections, s), strain, curvature * depth)
    if share == 0.0:
        k12 = sections.coupled_stiffness[s]
        return axial, moment * depth, sections.axial_stiffness[s], k12, k12, sections.bending_stiffness[s]
    _, _, k11, k12, k22 = _state_two(section, strain2, turn2)
    _, by_axial, by_moment = _share(section, limits, axial, moment)
    j11, j12, j21, j22 = _slopes(section, (k11, k12, k22), share, by_axial, by_moment, strain2, turn2, axial, moment)
    found = j11 * j22 - j12 * j21
    if not abs(found) > 1e-300:  # cracking turns right here: as if it did not grow
        j11, j12, j21, j22 = _slopes(section, (k11, k12, k22), share, 0.0, 0.0, strain2, turn2, axial, moment)
        found = j11 * j22 - j12 * j21
    i11, i12, i21, i22 = j22 / found, -j12 / found, -j21 / found, j11 / found
    return (
        axial,
        moment * depth,
        k11 * i11 + k12 * i21,
        (k11 * i12 + k12 * i22) * depth,
        (k12 * i11 + k22 * i21) * depth,
        (k12 * i12 + k22 * i22) * depth * depth,
    )


@rule
def commit_section(sections, s, memory, strain, curvature):
    """Commit the history variables of section s at an equilibrium: cracking and plastic strain of the steel.

    Parameters
    ----------
    sections : Sections
        Arrays (s,), see assembly/section.py.
    s : int
        Which of them.
    memory : SectionMemory
        History variables, changed in place.
    strain, curvature : float
        At mid-depth (1), tension positive; sagging (1/m).
    """
    if sections.law[s] == BRANSON:
        moment, _ = _branson(sections, s, memory, curvature)
        face = BOTTOM if moment > 0.0 else TOP
        memory.cracked[s, face] = max(memory.cracked[s, face], abs(moment))
        return
    section, limits = _section(sections, s, memory), _limits(sections, s)
    share, strain2, turn2, axial, moment = _shared(
        section, limits, _start(sections, s), strain, curvature * sections.depth[s]
    )
    if share == 0.0:
        return
    top, bottom, top_crush, bottom_crush = limits
    crushed = max(
        _cracking(top_crush[0] * axial + top_crush[1] * moment, section.beta)[0],
        _cracking(bottom_crush[0] * axial + bottom_crush[1] * moment, section.beta)[0],
    )
    cracked = memory.cracked[s]
    cracked[TOP] = max(cracked[TOP], crushed, _cracking(_pull(top, axial, moment)[0], section.beta)[0])
    cracked[BOTTOM] = max(cracked[BOTTOM], crushed, _cracking(_pull(bottom, axial, moment)[0], section.beta)[0])
    _, _, by_top = _steel(section, section.top_plastic, strain2 + turn2 * section.top_level)
    _, _, by_bottom = _steel(section, section.bottom_plastic, strain2 + turn2 * section.bottom_level)
    if by_top != 0.0 or by_bottom != 0.0:
        memory.plastic[s, TOP] += by_top
        memory.plastic[s, BOTTOM] += by_bottom
        widest = max(cracked[TOP], cracked[BOTTOM])
        cracked[TOP] = widest
        cracked[BOTTOM] = widest


# -- values of one section --------------------------------------------------------------------------------------------


@law
def _section(sections, s, memory):
    depth = sections.depth[s]
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
        sections.steel_modulus[s],
        sections.hardening_modulus[s],
        sections.steel_strength[s],
        sections.tension_stiffening[s],
        sections.top_area[s],
        sections.top_level[s] / depth,
        memory.plastic[s, TOP],
        memory.cracked[s, TOP],
        sections.bottom_area[s],
        sections.bottom_level[s] / depth,
        memory.plastic[s, BOTTOM],
        memory.cracked[s, BOTTOM],
    )


@law
def _limits(sections, s):
    """Return, each as a pair for N and M / depth: (concrete, wires) of the top, of the bottom, pressure of both."""
    pull, wires, crush = sections.pull, sections.wires_pull, sections.crush
    return (
        (pull[s, TOP, 0], pull[s, TOP, 1], wires[s, TOP, 0], wires[s, TOP, 1]),
        (pull[s, BOTTOM, 0], pull[s, BOTTOM, 1], wires[s, BOTTOM, 0], wires[s, BOTTOM, 1]),
        (crush[s, TOP, 0], crush[s, TOP, 1]),
        (crush[s, BOTTOM, 0], crush[s, BOTTOM, 1]),
    )


@law
def _start(sections, s):
    """Return the deformation of state II as the section cracks by bending, from above and from below."""
    first = sections.first_cracked
    return first[s, TOP, 0], first[s, TOP, 1], first[s, BOTTOM, 0], first[s, BOTTOM, 1]


@kernel
def bent_before(sections, memory):
    """Crack both faces of all sections by their earlier moment, without axial force.

    Parameters
    ----------
    sections : Sections
        With ``earlier_moment`` (Nm), not negative.
    memory : SectionMemory
        Its ``cracked`` is raised in place.
    """
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
        cracked[TOP] = max(cracked[TOP], _cracking(_pull(top, 0.0, -scaled)[0], beta)[0])
        cracked[BOTTOM] = max(cracked[BOTTOM], _cracking(_pull(bottom, 0.0, scaled)[0], beta)[0])


# -- Branson ----------------------------------------------------------------------------------------------------------


@rule
def _branson(sections, s, memory, curvature):
    """Return the moment (Nm) and its slope (Nm2)."""
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
        wrong = bent * (cracked + more) - moment
        step = wrong / (1.0 + bent * n * more / moment)
        moment += step
        if abs(step) <= CLOSE * moment:
            break
    more = (whole - cracked) * (first / moment) ** n
    slope = (cracked + more) / (1.0 + bent * n * more / moment)
    return (moment if curvature > 0.0 else -moment), slope


# -- two states -------------------------------------------------------------------------------------------------------


@rule
def _shared(section, limits, first, strain, turn):
    """Return (zeta, e2 as strain and turn, N, M / depth); with zeta = 0 only N and M are worked out."""
    axial, moment = section.k11 * strain + section.k12 * turn, section.k12 * strain + section.k22 * turn
    share, by_axial, by_moment = _share(section, limits, axial, moment)
    if share == 0.0:
        return share, 0.0, 0.0, axial, moment
    f11, f12, f22 = section.f11, section.f12, section.f22
    scale = abs(strain) + abs(turn) + abs(section.top_plastic) + abs(section.bottom_plastic)

    # a start: as deformed as the whole section; at the first cracks of bending, at least as much as these ask for
    strain2, turn2 = strain, turn
    if (by_axial != 0.0 or by_moment != 0.0) and abs(strain) < 0.5 * abs(turn):
        first_strain, first_turn = (first[2], first[3]) if turn > 0.0 else (first[0], first[1])
        if abs(first_turn) > abs(turn):
            strain2, turn2 = first_strain, first_turn
        else:
            strain2, turn2 = first_strain * turn / first_turn, turn

    # Newton, halving a step that does not help
    axial, moment, k11, k12, k22 = _state_two(section, strain2, turn2)
    share, by_axial, by_moment = _share(section, limits, axial, moment)
    wrong1 = (1.0 - share) * (f11 * axial + f12 * moment) + share * strain2 - strain
    wrong2 = (1.0 - share) * (f12 * axial + f22 * moment) + share * turn2 - turn
    wrong = abs(wrong1) + abs(wrong2)
    for _ in range(MOST_STEPS):
        if wrong <= CLOSE * scale:
            return share, strain2, turn2, axial, moment
        j11, j12, j21, j22 = _slopes(
            section, (k11, k12, k22), share, by_axial, by_moment, strain2, turn2, axial, moment
        )
        found = j11 * j22 - j12 * j21
        if not abs(found) > 1e-14 * (abs(j11 * j22) + abs(j12 * j21)):
            break
        step1 = (j22 * wrong1 - j12 * wrong2) / found
        step2 = (j11 * wrong2 - j21 * wrong1) / found
        before, start1, start2 = wrong, strain2, turn2
        for _ in range(8):
            strain2, turn2 = start1 - step1, start2 - step2
            axial, moment, k11, k12, k22 = _state_two(section, strain2, turn2)
            share, by_axial, by_moment = _share(section, limits, axial, moment)
            wrong1 = (1.0 - share) * (f11 * axial + f12 * moment) + share * strain2 - strain
            wrong2 = (1.0 - share) * (f12 * axial + f22 * moment) + share * turn2 - turn
            wrong = abs(wrong1) + abs(wrong2)
            if wrong < before:
                break
            step1 *= 0.5
            step2 *= 0.5
        if not wrong < before:
            break
    if wrong <= 1e3 * CLOSE * scale:
        return share, strain2, turn2, axial, moment
    return _bracketed(section, limits, strain, turn, scale)


@rule
def _bracketed(section, limits, strain, turn, scale):
    """Return what ``_shared`` does, without fail: for each zeta e2 is the lowest point of a convex energy."""
    low, high = 0.0, 1.0
    share, strain2, turn2, axial, moment = 1.0, strain, turn, 0.0, 0.0
    asked_low, asked_high, last = 0.0, 0.0, 0
    for trial in range(MOST_TRIALS):
        if trial == 0:
            share = 1.0
        elif trial < 3 or trial % 3 == 0 or asked_low <= asked_high:
            share = 0.5 * (low + high)
        else:
            share = low + (high - low) * asked_low / (asked_low - asked_high)
            if not low < share < high:
                share = 0.5 * (low + high)
        strain2, turn2, axial, moment = _at_share(section, strain, turn, share, strain2, turn2, CLOSE * scale)
        asked, _, _ = _share(section, limits, axial, moment)
        asked -= share
        if asked >= 0.0:
            if last == 1:  # Illinois: the end that stays counts less
                asked_high *= 0.5
            low, asked_low, last = share, asked, 1
        else:
            if last == -1:
                asked_low *= 0.5
            high, asked_high, last = share, asked, -1
            if trial == 0:
                asked_low = 1.0
        if abs(asked) <= CLOSE * share or high - low <= 1e-15 * high:
            break
    return share, strain2, turn2, axial, moment


@rule
def _at_share(section, strain, turn, share, strain2, turn2, close):
    """Return (e2 as strain and turn, N, M / depth) for a given zeta > 0.

    (1 - zeta) S(e2) + zeta K e2 = K e, with K the stiffness of state I, is where a convex function of e2 is lowest.
    """
    k11, k12, k22 = section.k11, section.k12, section.k22
    aim1, aim2 = k11 * strain + k12 * turn, k12 * strain + k22 * turn
    axial, moment, c11, c12, c22 = _state_two(section, strain2, turn2)
    uphill1 = (1.0 - share) * axial + share * (k11 * strain2 + k12 * turn2) - aim1
    uphill2 = (1.0 - share) * moment + share * (k12 * strain2 + k22 * turn2) - aim2
    for _ in range(100):
        h11 = (1.0 - share) * c11 + share * k11
        h12 = (1.0 - share) * c12 + share * k12
        h22 = (1.0 - share) * c22 + share * k22
        found = h11 * h22 - h12 * h12
        step1 = (h12 * uphill2 - h22 * uphill1) / found
        step2 = (h12 * uphill1 - h11 * uphill2) / found
        down = uphill1 * step1 + uphill2 * step2
        start1, start2 = strain2, turn2
        for _ in range(30):
            strain2, turn2 = start1 + step1, start2 + step2
            axial, moment, c11, c12, c22 = _state_two(section, strain2, turn2)
            uphill1 = (1.0 - share) * axial + share * (k11 * strain2 + k12 * turn2) - aim1
            uphill2 = (1.0 - share) * moment + share * (k12 * strain2 + k22 * turn2) - aim2
            if uphill1 * step1 + uphill2 * step2 <= -0.9 * down:
                break
            step1 *= 0.5
            step2 *= 0.5
        if share * (abs(step1) + abs(step2)) <= 0.1 * close:
            break
    return strain2, turn2, axial, moment


@law
def _slopes(section, stiffness, share, by_axial, by_moment, strain2, turn2, axial, moment):
    """Return by how much the deformation grows with that of state II: (1 - zeta) F K + zeta + (e2 - F s) dzeta/ds K."""
    f11, f12, f22 = section.f11, section.f12, section.f22
    k11, k12, k22 = stiffness
    apart1 = strain2 - f11 * axial - f12 * moment
    apart2 = turn2 - f12 * axial - f22 * moment
    grow1, grow2 = by_axial * k11 + by_moment * k12, by_axial * k12 + by_moment * k22
    whole = 1.0 - share
    return (
        whole * (f11 * k11 + f12 * k12) + share + apart1 * grow1,
        whole * (f11 * k12 + f12 * k22) + apart1 * grow2,
        whole * (f12 * k11 + f22 * k12) + apart2 * grow1,
        whole * (f12 * k12 + f22 * k22) + share + apart2 * grow2,
    )


# -- how much is cracked ----------------------------------------------------------------------------------------------


@law
def _pull(face, axial, moment):
    """Return r at a face, and by how much it grows with N and M / depth."""
    ratio = face[0] * axial + face[1] * moment
    wires = face[2] * axial + face[3] * moment
    if wires > ratio:
        return wires, face[2], face[3]
    return ratio, face[0], face[1]


@law
def _cracking(ratio, beta):
    """Return 1 - beta / r^2 and its slope; 0 for r <= 1."""
    if ratio <= 1.0:
        return 0.0, 0.0
    rising = (ratio - 1.0) / RISE
    share = 1.0 - beta / (ratio * ratio)
    if rising < share:
        return rising, 1.0 / RISE
    return share, 2.0 * beta / (ratio * ratio * ratio)


@rule
def _share(section, limits, axial, moment):
    """Return zeta and its slopes with N and M / depth."""
    on_top, on_bottom, top_crush, bottom_crush = limits
    beta = section.beta
    r_top, top_axial, top_moment = _pull(on_top, axial, moment)
    r_bottom, bottom_axial, bottom_moment = _pull(on_bottom, axial, moment)
    top, by_top = _cracking(r_top, beta)
    bottom, by_bottom = _cracking(r_bottom, beta)
    if section.top_cracked >= top:
        top, by_top = section.top_cracked, 0.0
    if section.bottom_cracked >= bottom:
        bottom, by_bottom = section.bottom_cracked, 0.0

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
            part = r_top / r_bottom
            share += (top - bottom) * part
            to_top = by_top * part + (top - bottom) / r_bottom
            to_bottom += -by_bottom * part - (top - bottom) * part / r_bottom
    else:
        share, to_top, to_bottom = top, by_top, 0.0
        if r_bottom > 0.0 and bottom > top:
            part = r_bottom / r_top
            share += (bottom - top) * part
            to_bottom = by_bottom * part + (bottom - top) / r_top
            to_top += -by_top * part - (bottom - top) * part / r_top
    by_axial = to_top * top_axial + to_bottom * bottom_axial
    by_moment = to_top * top_moment + to_bottom * bottom_moment
    for to_axial, to_moment in (top_crush, bottom_crush):
        ratio = to_axial * axial + to_moment * moment
        if ratio > 1.0:
            crushed, growing = _cracking(ratio, beta)
            if crushed > share:
                share, by_axial, by_moment = crushed, growing * to_axial, growing * to_moment
    return share, by_axial, by_moment


# -- state II ---------------------------------------------------------------------------------------------------------


@rule
def _state_two(section, strain, turn):
    """Return (N, M / depth, and their stiffness k11, k12, k22) of the cracked section."""
    concrete, crushing = section.concrete, section.crushing
    q0, q1, length, first, second = _pressed(-strain, -turn)
    if abs(turn) * 0.5 - strain > crushing:
        c0, c1, crushed, first_crushed, second_crushed = _pressed(-strain - crushing, -turn)
        q0 -= c0
        q1 -= c1
        length -= crushed
        first -= first_crushed
        second -= second_crushed
    axial, moment = -concrete * q0, -concrete * q1
    k11, k12, k22 = concrete * length, concrete * first, concrete * second
    for area, level, plastic in (
        (section.top_area, section.top_level, section.top_plastic),
        (section.bottom_area, section.bottom_level, section.bottom_plastic),
    ):
        there = strain + turn * level
        stress, slope, _ = _steel(section, plastic, there)
        if there < 0.0:  # steel takes the place of concrete
            if there > -crushing:
                stress -= section.modulus * there
                slope -= section.modulus
            else:
                stress += section.modulus * crushing
        axial += area * stress
        moment += area * stress * level
        k11 += area * slope
        k12 += area * slope * level
        k22 += area * slope * level * level
    return axial, moment, k11, k12, k22


@law
def _steel(section, plastic, strain):
    """Return stress, slope and plastic flow of a wire that hardens kinematically."""
    modulus, harder = section.steel, section.harder
    stress = modulus * (strain - plastic)
    beyond = stress - harder * plastic
    excess = abs(beyond) - section.strength
    if excess <= 0.0:
        return stress, modulus, 0.0
    flow = excess / (modulus + harder)
    flow = flow if beyond > 0.0 else -flow
    return stress - modulus * flow, modulus * harder / (modulus + harder), flow


@law
def _pressed(mean, slope):
    """Integrate y = mean + slope x where y > 0, for x from -1/2 to 1/2: y, x y, 1, x and x^2."""
    top, bottom = mean - 0.5 * slope, mean + 0.5 * slope
    if top <= 0.0 and bottom <= 0.0:
        return 0.0, 0.0, 0.0, 0.0, 0.0
    if top >= 0.0 and bottom >= 0.0:
        return mean, slope / 12.0, 1.0, 0.0, 1.0 / 12.0
    most = bottom if bottom > 0.0 else top
    side = 0.5 if bottom > 0.0 else -0.5
    length = most / abs(slope)
    length = length if length < 1.0 else 1.0
    middle = side * (1.0 - length)
    whole = 0.5 * most * length
    return (
        whole,
        whole * side * (1.0 - 2.0 / 3.0 * length),
        length,
        length * middle,
        length * (middle * middle + length * length / 12.0),
    )


# -- one section on its own -------------------------------------------------------------------------------------------


@kernel
def moments_along(sections, memory, curvature, axial_force, strains, moments):
    """Compute the moment-curvature diagram of section 0 under a constant axial force.

    At each curvature the strain that balances the axial force is found by bracketed Newton iterations, and committed.

    Parameters
    ----------
    sections : Sections
        See assembly/section.py; the first is bent.
    memory : SectionMemory
        History variables, changed in place.
    curvature : array (k,)
        In the order of bending, sagging positive (1/m).
    axial_force : float
        N, tension positive (N).
    strains, moments : array (k,)
        Filled: strain at mid-depth (1), moment, sagging positive (Nm).
    """
    strain = 0.0
    axial = sections.axial_stiffness[0]
    for i in range(curvature.size):
        # N grows with the strain: bracket, then Newton kept inside
        force, _, slope, _, _, _ = section_response(sections, 0, memory, strain, curvature[i])
        low, high = strain, strain
        reach = 1e-6 + abs(axial_force - force) / axial
        while force > axial_force:
            high = low
            low -= reach
            reach *= 2.0
            force, _, slope, _, _, _ = section_response(sections, 0, memory, low, curvature[i])
        reach = 1e-6 + abs(axial_force - force) / axial
        force, _, slope, _, _, _ = section_response(sections, 0, memory, high, curvature[i])
        while force < axial_force:
            low = high
            high += reach
            reach *= 2.0
            force, _, slope, _, _, _ = section_response(sections, 0, memory, high, curvature[i])
        strain = low if low == high else 0.5 * (low + high)
        for _ in range(200):
            force, _, slope, _, _, _ = section_response(sections, 0, memory, strain, curvature[i])
            if force > axial_force:
                high = strain
            else:
                low = strain
            wrong = force - axial_force
            step = wrong / slope if slope > 0.0 else 0.0
            if abs(wrong) <= 1e-12 * axial * (abs(strain) + abs(curvature[i]) * sections.depth[0]):
                break
            if high - low <= 1e-15 * (abs(low) + abs(high)):
                break
            strain -= step
            if not low < strain < high or step == 0.0:
                strain = 0.5 * (low + high)
        _, moments[i], _, _, _, _ = section_response(sections, 0, memory, strain, curvature[i])
        strains[i] = strain
        commit_section(sections, 0, memory, strain, curvature[i])
