"""Sections of a reinforced-concrete footing against calculation by hand."""

import numpy as np
import pytest

from damagepred.assembly.section import SectionMemory, _second_moments, concrete_sections
from damagepred.errors import InputError
from damagepred.kernels.concrete_section.law import BRANSON, commit_section, section_response
from damagepred.kernels.jit import kernel
from damagepred.scene import Footing, ReinforcedConcrete


def footing(width=0.3, depth=0.3, **concrete):
    return Footing(width=width, depth=depth, concrete=ReinforcedConcrete(**concrete))


def cracking_moment(footing, axial_force=0.0):
    """Cracking moment (Nm) from below, under an axial force (N) at mid-depth."""
    sections = concrete_sections(np.zeros(1, np.int64), 1.0, footing)
    if sections.law[0] == BRANSON:
        return float(sections.cracking_moment[0])
    moments = [(1.0 - by[0] * axial_force) / by[1] for by in (sections.pull[0, 1], sections.wires_pull[0, 1])]
    return float(max(0.0, min(moments)) * footing.depth)


@kernel
def moment_curvature_diagram(sections, memory, curvature, axial_force, strains, moments):
    """Fill strains and moments of section 0 at rising curvature and constant axial force, and commit each state."""
    strain = 0.0
    axial = sections.axial_stiffness[0]
    for i in range(curvature.size):
        # N grows with the strain: bracketed Newton iterations
        force, _, slope, _, _, _ = section_response(sections, 0, memory, strain, curvature[i])
        low, high = strain, strain
        width = 1e-6 + abs(axial_force - force) / axial
        while force > axial_force:
            high = low
            low -= width
            width *= 2.0
            force, _, slope, _, _, _ = section_response(sections, 0, memory, low, curvature[i])
        width = 1e-6 + abs(axial_force - force) / axial
        force, _, slope, _, _, _ = section_response(sections, 0, memory, high, curvature[i])
        while force < axial_force:
            low = high
            high += width
            width *= 2.0
            force, _, slope, _, _, _ = section_response(sections, 0, memory, high, curvature[i])
        strain = low if low == high else 0.5 * (low + high)
        for _ in range(200):
            force, _, slope, _, _, _ = section_response(sections, 0, memory, strain, curvature[i])
            if force > axial_force:
                high = strain
            else:
                low = strain
            excess = force - axial_force
            step = excess / slope if slope > 0.0 else 0.0
            if abs(excess) <= 1e-12 * axial * (abs(strain) + abs(curvature[i]) * sections.depth[0]):
                break
            if high - low <= 1e-15 * (abs(low) + abs(high)):
                break
            strain -= step
            if not low < strain < high or step == 0.0:
                strain = 0.5 * (low + high)
        _, moments[i], _, _, _, _ = section_response(sections, 0, memory, strain, curvature[i])
        strains[i] = strain
        commit_section(sections, 0, memory, strain, curvature[i])


def moment_curvature(footing, curvature):
    """Moments (Nm, sagging positive) of a section bent by a sequence of curvatures (1/m)."""
    path = np.ascontiguousarray(np.atleast_1d(curvature), dtype=float)
    strains, moments = np.zeros_like(path), np.zeros_like(path)
    sections = concrete_sections(np.zeros(1, np.int64), 1.0, footing)
    moment_curvature_diagram(sections, SectionMemory.at_first(sections), path, 0.0, strains, moments)
    return moments


def by_hand(width, depth, n, area, d):
    """Neutral axis and I_cr of a section with one layer of wires."""
    x = (-n * area + np.sqrt((n * area) ** 2 + 2 * width * n * area * d)) / width
    return x, width * x**3 / 3 + n * area * (d - x) ** 2


class TestSecondMoments:
    def test_one_layer_by_hand(self):
        moments = _second_moments(footing(0.4, 0.35, bottom="4-L12TM", top="none", grade="N20"))
        _, expected = by_hand(0.4, 0.35, 200 / 24.0, 4 * 111.2e-6, 0.35 - 0.04 - 0.0119 / 2)
        assert moments.sagging == pytest.approx(expected, rel=1e-12)

    def test_pressed_wires_by_hand(self):
        """With much steel below, the top wires lie in compressed concrete, which they replace."""
        concrete = {"bottom": "12-L12TM", "top": "2-L12TM", "cover": 0.01}
        found = _second_moments(footing(**concrete)).sagging
        n, area, other = 200 / 26.7, 12 * 111.2e-6, 2 * 111.2e-6
        d, high = 0.3 - 0.01 - 0.0119 / 2, 0.01 + 0.0119 / 2
        x = max(np.roots([0.15, n * area + (n - 1) * other, -n * area * d - (n - 1) * other * high]))
        assert x > high
        expected = 0.1 * x**3 + n * area * (d - x) ** 2 + (n - 1) * other * (x - high) ** 2
        assert found == pytest.approx(expected, rel=1e-12)


class TestCrackingMoment:
    def test_by_hand(self):
        """f_ct I / y of the transformed section, which has its centroid at mid-depth."""
        more, level = (200 / 26.7 - 1) * 3 * 89.9e-6, 0.15 - 0.04 - 0.0107 / 2
        transformed = 0.3**4 / 12 + 2 * more * level**2
        assert cracking_moment(footing()) == pytest.approx(3e6 * transformed / 0.15, rel=1e-12)
        pressed = 3e6 + 20e3 / (0.09 + 2 * more)
        assert cracking_moment(footing(), -20e3) == pytest.approx(pressed * transformed / 0.15, rel=1e-12)

    def test_branson_counts_concrete_alone(self):
        assert cracking_moment(footing(law="branson")) == pytest.approx(3e6 * 0.3**3 / 6)


class TestMomentCurvature:
    @pytest.mark.parametrize("beta", [1.0, 0.5])
    @pytest.mark.parametrize("times", [1.2, 1.5, 2.0])
    def test_mean_curvature_by_hand(self, beta, times):
        """EN 1992-1-1 7.4.3: (1 - zeta) M / EI_1 + zeta M / EI_2 with zeta = 1 - beta (M_cr / M)^2."""
        beam = footing(tension_stiffening=beta)
        first = cracking_moment(beam)
        moment, zeta = times * first, 1 - beta / times**2
        whole = concrete_sections(np.zeros(1, np.int64), 1.0, beam).bending_stiffness[0]
        cracked = 26.7e9 * _second_moments(beam).sagging
        curvature = (1 - zeta) * moment / whole + zeta * moment / cracked
        assert moment_curvature(beam, [curvature])[0] == pytest.approx(moment, rel=1e-9)
        assert moment_curvature(beam, [-curvature])[0] == pytest.approx(-moment, rel=1e-9)

    def test_yield_by_hand(self):
        """The wires yield at f_y I_cr / (n (d - x)); beyond it the curvature grows rapidly."""
        beam = footing(bottom="3-L8TM", top="none")
        area, d = 3 * 45.4e-6, 0.3 - 0.04 - 0.0076 / 2
        x, second = by_hand(0.3, 0.3, 200 / 26.7, area, d)
        moment = 500e6 * second / (200 / 26.7 * (d - x))
        zeta = 1 - (cracking_moment(beam) / moment) ** 2
        whole = concrete_sections(np.zeros(1, np.int64), 1.0, beam).bending_stiffness[0]
        curvature = (1 - zeta) * moment / whole + zeta * moment / (26.7e9 * second)
        before, at, after = moment_curvature(beam, np.array([0.99, 1.0, 1.01]) * curvature)
        # the wires a face has at least change the rest by a thousandth; the centroid is not at mid-depth either
        assert at == pytest.approx(moment, rel=2e-3)
        assert after - at < 0.5 * (at - before)

    def test_strength_by_hand(self):
        """Far beyond yield: hardened wires against concrete at f'c; the lever arm is d - a / 2."""
        beam = footing(bottom="3-L8TM", top="none", hardening=0.01)
        curvature = 0.1
        moment = moment_curvature(beam, np.linspace(0, curvature, 200))[-1]
        area, d = 3 * 45.4e-6, 0.3 - 0.04 - 0.0076 / 2
        # share of the cracked state, and what it is bent by
        zeta = 1 - (cracking_moment(beam) / moment) ** 2
        bent = curvature / zeta
        strain = bent * (d - 0.02)
        pull = area * (500e6 + 0.01 * 200e9 * (strain - 0.0025))
        assert moment == pytest.approx(pull * (d - pull / 25e6 / 0.3 / 2), rel=0.03)


class TestBranson:
    def test_formula(self):
        beam = footing(law="branson")
        first, (gross, cracked, _) = cracking_moment(beam), _second_moments(beam)
        moment = 1.7 * first
        effective = cracked + (gross - cracked) / 1.7**3
        curvature = moment / (26.7e9 * effective)
        moments = moment_curvature(beam, [0.5 * first / (26.7e9 * gross), curvature, 0.3 * curvature, -curvature / 100])
        assert moments[:2] == pytest.approx([0.5 * first, moment], rel=1e-9)
        assert moments[2] == pytest.approx(0.3 * moment, rel=1e-9)
        assert moments[3] == pytest.approx(-26.7e9 * gross * curvature / 100, rel=1e-9)


class TestWrongInput:
    def test_no_concrete(self):
        with pytest.raises(InputError, match=r"footing.concrete"):
            moment_curvature(Footing(), [0.0])

    def test_wires_above_mid_depth(self):
        with pytest.raises(InputError, match=r"cover = 0.2: .*mid-depth.*depth = 0.3 m"):
            concrete_sections(np.zeros(1, np.int64), 1.0, footing(cover=0.2, top="none"))


class TestEarlierMoment:
    @pytest.mark.parametrize("law", ["cracked", "branson"])
    def test_is_as_if_it_had_been_bent_by_it(self, law):
        """Unloaded from a moment, and bent by half of it again, it is as soft as a section with this earlier moment."""
        loading = np.linspace(0.0, 3e-3, 400)
        moments = moment_curvature(footing(law=law), loading)
        reached = moments[-1]
        assert reached > 1.2 * cracking_moment(footing(law=law))
        again = moment_curvature(footing(law=law), [*loading, 0.0, 1e-3])[-1]
        told = moment_curvature(footing(law=law, earlier_moment=float(reached)), [1e-3])[-1]
        assert told == pytest.approx(again, rel=1e-3)
        assert told < 0.8 * moment_curvature(footing(law=law), [1e-3])[-1]

    def test_nothing_below_the_cracking_moment(self):
        whole, before = (moment_curvature(footing(earlier_moment=m), [5e-4])[0] for m in (0.0, 10e3))
        assert before == whole
