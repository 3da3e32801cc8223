"""State II of a reinforced-concrete section: concrete without tension, pressed up to f'c, and steel that yields."""

from damagepred.kernels.jit import law, rule


@rule
def state_two(section, strain, turn):
    """Forces and tangent (N, M / depth, t11, t12, t22) of the cracked section, integrated in closed form."""
    concrete, crushing = section.concrete, section.crushing
    q0, q1, length, first, second = _compression_integrals(-strain, -turn)
    if abs(turn) * 0.5 - strain > crushing:
        c0, c1, crushed, first_crushed, second_crushed = _compression_integrals(-strain - crushing, -turn)
        q0 -= c0
        q1 -= c1
        length -= crushed
        first -= first_crushed
        second -= second_crushed
    axial, moment = -concrete * q0, -concrete * q1
    t11, t12, t22 = concrete * length, concrete * first, concrete * second
    for wire in (section.top, section.bottom):
        area, level = wire.area, wire.level
        there = strain + turn * level
        stress, slope, _ = steel_stress(section, wire.plastic, there)
        if there < 0.0:  # steel replaces concrete
            if there > -crushing:
                stress -= section.modulus * there
                slope -= section.modulus
            else:
                stress += section.modulus * crushing
        axial += area * stress
        moment += area * stress * level
        t11 += area * slope
        t12 += area * slope * level
        t22 += area * slope * level * level
    return axial, moment, t11, t12, t22


@law
def steel_stress(section, plastic, strain):
    """Stress, slope and plastic flow of a wire: return mapping with linear kinematic hardening."""
    modulus, hardening = section.steel, section.hardening
    stress = modulus * (strain - plastic)
    beyond = stress - hardening * plastic
    excess = abs(beyond) - section.strength
    if excess <= 0.0:
        return stress, modulus, 0.0
    flow = excess / (modulus + hardening)
    flow = flow if beyond > 0.0 else -flow
    return stress - modulus * flow, modulus * hardening / (modulus + hardening), flow


@law
def _compression_integrals(mean, slope):
    """Integrals of y, x y, 1, x and x^2 over the part of [-1/2, 1/2] where y = mean + slope x > 0."""
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
