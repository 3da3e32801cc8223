"""Any softening joint, opened and closed along any path, dissipates exactly its fracture energy."""

from itertools import pairwise

import numpy as np
from hypothesis import given, settings
from hypothesis import strategies as st

from damagepred.kernels.joint.explicit_update import explicit_update
from damagepred.kernels.joint.softening import Softening
from tests.kernels.one_joint import one_joint

Joint = tuple[float, float, float]


@st.composite
def joints(draw: st.DrawFn) -> Joint:
    """Stiffness, strength and fracture energy; from hardly more than the elastic energy to very tough."""
    k_n, f_t = 10.0 ** draw(st.floats(9, 12)), 10.0 ** draw(st.floats(3, 6.5))
    return k_n, f_t, f_t**2 / (2 * k_n) * (1.0 + 10.0 ** draw(st.floats(-3, 4)))


SHARES = st.lists(st.floats(-0.5, 1.2), max_size=12)


def normal_stress(joint: Joint, opening: float, cracked: bool, kappa: float) -> tuple[float, bool, float]:
    k_n, f_t, energy = joint
    w_c = 2 * energy / f_t
    parameters = one_joint(k_n, 0.4 * k_n, (f_t, 4 * f_t, 0.7), (0.0, 4 * f_t, 0.7), w_c=w_c)
    history = (0.0, 0.0, cracked, kappa)
    sigma, _, _, _, cracked, kappa = explicit_update(opening, 0.0, *history, parameters, None, Softening(None))
    return sigma, cracked, kappa


@settings(max_examples=150, deadline=None, derandomize=True)
@given(joints(), SHARES)
def test_full_opening_dissipates_the_fracture_energy(joint: Joint, shares: list[float]) -> None:
    k_n, f_t, energy = joint
    w_c = 2 * energy / f_t
    turns = [0.0, *(share * w_c for share in shares), 1.3 * w_c]
    work, sigma, cracked, kappa, bond = 0.0, 0.0, False, 0.0, 1.0
    for here, there in pairwise(turns):
        # the law is linear between these, so the trapezoidal rule is exact
        corners = [c for c in (0.0, f_t / k_n, kappa, w_c) if min(here, there) < c < max(here, there)]
        at = here
        for opening in (*sorted(corners, reverse=there < here), there):
            before = sigma
            sigma, cracked, kappa = normal_stress(joint, opening, cracked, kappa)
            work += 0.5 * (before + sigma) * (opening - at)
            left = np.clip((w_c - kappa) / (w_c - f_t / k_n), 0.0, 1.0) if cracked else 1.0
            assert 0.0 <= left <= bond
            assert sigma <= f_t * left * (1 + 1e-12)
            at, bond = opening, left
    assert bond == 0.0
    largest = max(np.abs(turns).max() * k_n, f_t)  # in compression much work is stored and recovered
    assert abs(work - energy) <= 1e-10 * max(energy, largest**2 / k_n)
