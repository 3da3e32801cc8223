"""The law of one section: forces, tangent and history, over random states and histories."""

import numpy as np
import pytest

from damagepred.assembly.section import SectionMemory, concrete_sections
from damagepred.kernels.concrete_section import law
from damagepred.kernels.concrete_section.state_two import state_two
from damagepred.kernels.jit import kernel
from damagepred.scene import Footing, ReinforcedConcrete


# compiled once and kept, as rules are not
@kernel
def response(sections, memory, strain, curvature):
    return law.section_response(sections, 0, memory, strain, curvature)


@kernel
def settle(sections, memory, strain, curvature):
    law.commit_section(sections, 0, memory, strain, curvature)


@kernel
def cracked_state(sections, memory, strain, curvature):
    return state_two(law._section(sections, 0, memory), strain, curvature * sections.depth[0])


@kernel
def two_states(sections, memory, strain, curvature):
    """Return share, strain and curvature of the cracked state, and the share that follows from the forces."""
    values, limits, depth = law._section(sections, 0, memory), law._limits(sections, 0), sections.depth[0]
    share, strain2, turn2, axial, moment = law._solve_compatibility(
        values, limits, sections.first_cracked[0], strain, curvature * depth
    )
    return share, strain2, turn2 / depth, law._share(values, limits, axial, moment)[0]


def section(width=0.3, depth=0.3, **concrete):
    beam = Footing(width=width, depth=depth, concrete=ReinforcedConcrete(**concrete))
    return concrete_sections(np.zeros(1, np.int64), 0.24, beam)


def random_section(rng):
    return section(
        rng.uniform(0.2, 0.9),
        rng.uniform(0.25, 0.6),
        bottom=rng.choice(["2-L8TM", "3-L11TM", "4-L12TM"]),
        top=rng.choice([None, "none", "3-L8TM"]),
        tension_stiffening=rng.choice([1.0, 0.5, 0.0]),
        hardening=10 ** rng.uniform(-3, -1),
    )


def stiffness(sections):
    k12 = sections.coupled_stiffness[0]
    return np.array([[sections.axial_stiffness[0], k12], [k12, sections.bending_stiffness[0]]])


def by_layers(sections, plastic, strain, curvature, layers=40000):
    """N and M of the cracked state: concrete in layers, wires in separate lines."""
    width, depth = sections.width[0], sections.depth[0]
    z = (np.arange(layers) + 0.5) / layers * depth - depth / 2

    def concrete(at):
        return np.clip(at, -sections.crushing_strain[0], 0.0) * sections.concrete_modulus[0]

    stress = concrete(strain + curvature * z) * width * depth / layers
    axial, moment = stress.sum(), (stress * z).sum()
    for area, level, before in (
        (sections.wires.top_area[0], sections.wires.top_level[0], plastic[0]),
        (sections.wires.bottom_area[0], sections.wires.bottom_level[0], plastic[1]),
    ):
        at = strain + curvature * level
        # kinematic hardening: between two lines of the hardened slope
        modulus, harder, limit = sections.wires.modulus[0], sections.wires.hardening[0], sections.wires.strength[0]
        slope = modulus * harder / (modulus + harder)
        bound = limit * modulus / (modulus + harder)
        wire = np.clip(modulus * (at - before), slope * at - bound, slope * at + bound)
        axial += area * (wire - concrete(at))
        moment += area * (wire - concrete(at)) * level
    return axial, moment


def random_strains(rng, depth):
    size, angle = 10 ** rng.uniform(-5, -2.2), rng.uniform(0, 2 * np.pi)
    return size * np.cos(angle) * rng.choice([1.0, 0.2]), 2 * size * np.sin(angle) / depth


def test_cracked_state_is_that_of_many_layers():
    rng = np.random.default_rng(1)
    for _ in range(60):
        sections, memory = random_section(rng), SectionMemory.fresh(1)
        memory.plastic[0] = rng.normal(0, 0.003, 2) * rng.integers(0, 2)
        strain, curvature = random_strains(rng, sections.depth[0])
        axial, moment, *_ = cracked_state(sections, memory, strain, curvature)
        expected = by_layers(sections, memory.plastic[0], strain, curvature)
        scale = sections.axial_stiffness[0] * (abs(strain) + abs(curvature) * sections.depth[0])
        assert axial == pytest.approx(expected[0], abs=1e-6 * scale)
        assert moment * sections.depth[0] == pytest.approx(expected[1], abs=1e-6 * scale * sections.depth[0])


def test_two_states_add_up_and_the_tangent_is_that_of_the_forces():
    """Over random histories: an independent residual of the law, and finite differences."""
    rng = np.random.default_rng(2)
    cracked = 0
    for _ in range(60):
        sections, memory = random_section(rng), SectionMemory.fresh(1)
        depth, whole = sections.depth[0], stiffness(sections)
        scale = np.array([1.0, depth])
        for _ in range(4):
            strain, curvature = random_strains(rng, depth)
            found = np.array(response(sections, memory, strain, curvature))
            assert np.isfinite(found).all()
            share, strain2, curvature2, asked = two_states(sections, memory, strain, curvature)
            size = abs(strain) + abs(curvature) * depth + np.abs(memory.plastic).sum()
            if share > 0:
                cracked += 1
                forces = np.array(by_layers(sections, memory.plastic[0], strain2, curvature2, 4000))
                assert forces == pytest.approx(found[:2], rel=1e-4, abs=1e-5 * whole[0, 0] * size)
                one = np.linalg.solve(whole, found[:2])
                wrong = (1 - share) * one + share * np.array([strain2, curvature2]) - [strain, curvature]
                assert np.abs(wrong * scale).sum() < 1e-8 * size
                assert asked == pytest.approx(share, rel=1e-6)
            tangent = found[2:].reshape(2, 2) / np.outer(scale, scale)
            step = 1e-6 * (abs(strain) + abs(curvature) * depth)
            for column, (by, turn) in enumerate(((step, 0.0), (0.0, step / depth))):
                more = response(sections, memory, strain + by, curvature + turn)
                less = response(sections, memory, strain - by, curvature - turn)
                slope = (np.array(more[:2]) - np.array(less[:2])) / (2 * step) / scale
                assert slope == pytest.approx(tangent[:, column], abs=1e-4 * whole[0, 0])
            if rng.random() < 0.7:
                settle(sections, memory, strain, curvature)
    assert cracked > 120


def test_tension_cracks_the_section_and_the_wires_remain():
    """N = E_s A_s e2 and e = (1 - zeta) N / EA + zeta e2 with zeta = 1 - (N_cr / N)^2, by hand."""
    sections, memory = section(width=0.15, bottom="4-L12TM"), SectionMemory.fresh(1)
    wires = 200e9 * 8 * 111.2e-6
    whole = 26.7e9 * 0.15 * 0.3 + (200e9 - 26.7e9) * 8 * 111.2e-6
    first = 3e6 / 26.7e9 * whole
    axial = 1.6 * first
    assert axial < 0.9 * 500e6 * 8 * 111.2e-6
    zeta = 1 - 1 / 1.6**2
    found = response(sections, memory, (1 - zeta) * axial / whole + zeta * axial / wires, 0.0)
    assert found[:2] == pytest.approx((axial, 0.0), rel=1e-9, abs=1e-3)
    settle(sections, memory, 0.05, 0.0)
    assert memory.cracked[0] == pytest.approx(memory.cracked[0, ::-1])
    assert memory.plastic[0, 0] > 0.04


@pytest.mark.parametrize(("beta", "axial"), [(1.0, 0.0), (1.0, -50e3), (0.5, 0.0)])
def test_tangent_of_bending_is_positive(beta, axial):
    """Positive in its symmetric part for beta = 1 and N <= 0, by its determinant also for beta < 1."""
    sections, memory = section(tension_stiffening=beta), SectionMemory.fresh(1)
    strain, depth = 0.0, sections.depth[0]
    for curvature in np.linspace(1e-5, 0.03, 300):
        for _ in range(50):
            found = response(sections, memory, strain, curvature)
            if abs(found[0] - axial) < 1e-3:
                break
            strain -= (found[0] - axial) / found[2]
        assert found[0] == pytest.approx(axial, abs=1.0)
        tangent = np.array(found[2:]).reshape(2, 2) / np.outer((1.0, depth), (1.0, depth))
        assert np.linalg.det(tangent) > 0
        if beta == 1.0:
            assert np.linalg.eigvalsh(tangent + tangent.T)[0] > 0
        settle(sections, memory, strain, curvature)


@kernel
def bracketed(sections, memory, strain, curvature):
    """Return share, strain and curvature of the cracked state, N and M, by bisection."""
    values, depth = law._section(sections, 0, memory), sections.depth[0]
    turn = curvature * depth
    scale = abs(strain) + abs(turn) + abs(values.top.plastic) + abs(values.bottom.plastic)
    share, strain2, turn2, axial, moment = law._solve_bracketed(values, law._limits(sections, 0), strain, turn, scale)
    return share, strain2, turn2 / depth, axial, moment * depth


def test_the_search_that_cannot_fail_finds_what_newton_does():
    rng = np.random.default_rng(5)
    cracked = 0
    for _ in range(60):
        sections, memory = random_section(rng), SectionMemory.fresh(1)
        memory.plastic[0] = rng.normal(0, 0.002, 2) * rng.integers(0, 2)
        memory.cracked[0] = rng.uniform(0, 0.5, 2)
        depth = sections.depth[0]
        strain, curvature = random_strains(rng, depth)
        share, strain2, curvature2, _ = two_states(sections, memory, strain, curvature)
        if share == 0.0:
            continue
        cracked += 1
        found = bracketed(sections, memory, strain, curvature)
        size = abs(strain) + abs(curvature) * depth + np.abs(memory.plastic).sum()
        assert found[0] == pytest.approx(share, rel=1e-6)
        assert found[1:3] == pytest.approx((strain2, curvature2), abs=1e-6 * size / min(depth, share))
        forces = response(sections, memory, strain, curvature)[:2]
        assert found[3:] == pytest.approx(forces, abs=1e-6 * sections.axial_stiffness[0] * size)
    assert cracked > 30


@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_branson_by_hand(sign):
    """M = E I_e curvature, I_e = I_cr + (I - I_cr) (M_cr / M_a)^n, M_a the largest moment that pulled at that face."""
    sections, memory = section(law="branson", bottom="3-L11TM", top="2-L8TM"), SectionMemory.fresh(1)
    face = 1 if sign > 0 else 0
    first, n, whole = sections.cracking_moment[0], sections.exponent[0], sections.bending_stiffness[0]
    left = sections.cracked_second_moment[0, face] * sections.concrete_modulus[0]
    assert left < 0.5 * whole
    assert left != sections.cracked_second_moment[0, 1 - face] * sections.concrete_modulus[0]

    def secant(largest):
        return left + (whole - left) * (first / largest) ** n

    for largest in (1.2 * first, 3.0 * first):
        curvature = sign * largest / secant(largest)
        axial, moment, by_strain, across, back, slope = response(sections, memory, 1e-5, curvature)
        assert moment == pytest.approx(sign * largest)
        assert axial == pytest.approx(sections.axial_stiffness[0] * 1e-5)
        assert (by_strain, across, back) == (sections.axial_stiffness[0], 0.0, 0.0)
        more, less = (response(sections, memory, 0.0, (1 + by) * curvature)[1] for by in (1e-6, -1e-6))
        assert slope == pytest.approx((more - less) / (2e-6 * curvature), rel=1e-6)
        settle(sections, memory, 0.0, curvature)
        assert memory.cracked[0, face] == pytest.approx(largest)
        assert memory.cracked[0, 1 - face] == 0.0
        assert response(sections, memory, 0.0, 0.4 * curvature)[1] == pytest.approx(0.4 * sign * largest)
        settle(sections, memory, 0.0, 0.4 * curvature)
        assert memory.cracked[0, face] == pytest.approx(largest)
