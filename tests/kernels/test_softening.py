"""A softening bond along paths with known solutions, and compared with the law written with branches."""

import numpy as np
import pytest

from damagepred.kernels.joint.explicit_update import explicit_update
from damagepred.kernels.joint.softening import Softening
from tests.kernels.one_joint import one_joint

K_N, K_S = 82e9, 36e9
F_T, COHESION, FRICTION = 0.45e6, 0.375e6, 0.75
C_LEFT, FRICTION_LEFT = 0.05e6, 0.5
G_F = 10.0
U_0, W_C = F_T / K_N, 2 * G_F / F_T
REST = (0.0, 0.0, False, 0.0)  # slip, dilated, cracked, opened


def contact(
    opening,
    shear=0.0,
    history=REST,
    *,
    w_c=W_C,
    psi=0.0,
    brittle=False,
    strength=(F_T, COHESION, FRICTION),
    residual_strength=(0.0, C_LEFT, FRICTION_LEFT),
):
    """Return (sigma, tau) and the new history; w_c = None compiles the law without softening."""
    softening = None if w_c is None else Softening(True)
    parameters = one_joint(K_N, K_S, strength, residual_strength, w_c=w_c or 0.0, psi=psi, brittle=brittle)
    sigma, tau, *new = explicit_update(opening, shear, history, parameters, True, softening)
    return (sigma, tau), tuple(new)


def pull(openings, history=REST, **law):
    """Return the normal stress along a path of openings, and the final history."""
    stress = np.empty(len(openings))
    for i, opening in enumerate(openings):
        (stress[i], _), history = contact(opening, 0.0, history, **law)
    return stress, history


def bond(kappa):
    return min(max((W_C - kappa) / (W_C - U_0), 0.0), 1.0)


def test_tension_rises_to_strength_and_softens_to_zero_at_the_critical_opening():
    stress, _ = pull(U_0 * np.array([0.5, 1.0 - 1e-12]))
    np.testing.assert_allclose(stress, [0.5 * F_T, F_T], rtol=1e-11)
    share = np.array([1e-9, 0.25, 0.5, 0.9, 1.0 - 1e-12])
    stress, history = pull(U_0 + share * (W_C - U_0))
    np.testing.assert_allclose(stress, (1 - share) * F_T, atol=1e-10 * F_T)
    assert history[2]
    assert history[3] == U_0 + share[-1] * (W_C - U_0)
    stress, history = pull([W_C, 2 * W_C], history)
    np.testing.assert_array_equal(stress, 0.0)


@pytest.mark.parametrize("far", [1.001, 2.0, 5.0, 8.0])
def test_unloading_goes_straight_to_the_origin_and_reloading_back_to_the_envelope(far):
    _, history = pull([far * U_0])
    assert history[2:] == (True, far * U_0)
    top = F_T * bond(far * U_0)
    for share in (1.0, 0.7, 0.1, 1e-6, 0.0, 0.4, 1.0):
        stress, history = pull([share * far * U_0], history)
        assert stress[0] == pytest.approx(share * top, rel=1e-12)
        assert history[3] == far * U_0
    stress, history = pull([(far + 0.5) * U_0], history)
    assert stress[0] == pytest.approx(F_T * bond((far + 0.5) * U_0), rel=1e-12)
    assert history[3] == (far + 0.5) * U_0


def test_integrity_only_decreases_and_limits_the_stress():
    rng = np.random.default_rng(1)
    for psi, brittle in ((0.0, False), (0.0, True), (0.4, False), (0.4, True)):
        for _ in range(20):
            history, opening, shear, last = REST, 0.0, 0.0, 1.0
            for _ in range(60):
                opening += rng.normal(scale=2 * U_0)
                shear += rng.normal(scale=2e-5)
                (sigma, _), history = contact(opening, shear, history, psi=psi, brittle=brittle)
                left = np.clip((W_C - history[3]) / (W_C - F_T / K_N), 0.0, 1.0) if history[2] else 1.0
                assert 0.0 <= left <= last
                assert sigma <= F_T * left * (1 + 1e-12)
                assert (history[3] > 0.0) == history[2]
                last = left


@pytest.mark.parametrize("psi", [0.0, 0.3])
@pytest.mark.parametrize("brittle", [False, True])
@pytest.mark.parametrize("strength", [(F_T, COHESION, FRICTION), (0.0, 0.0, FRICTION), (0.0, COHESION, 0.0)])
def test_no_critical_opening_is_the_brittle_law_to_the_last_bit(psi, brittle, strength):
    """So walls with some softening joints are right, too."""
    rng = np.random.default_rng(2)
    residual_strength = (0.1 * strength[0], 0.3 * strength[1], 0.8 * strength[2])
    for _ in range(20):
        one = other = REST
        opening = shear = 0.0
        for _ in range(40):
            opening += rng.normal(scale=U_0)
            shear += rng.normal(scale=2e-5)
            law = {"psi": psi, "brittle": brittle, "strength": strength, "residual_strength": residual_strength}
            stress, one = contact(opening, shear, one, w_c=None, **law)
            again, other = contact(opening, shear, other, w_c=0.0, **law)
            assert stress == again
            assert one == other
            assert one[3] == 0.0


@pytest.mark.parametrize("far", [1.5, 3.0, 6.0, 20.0])
@pytest.mark.parametrize("sigma", [-1e6, -1e3, 0.0])
def test_cohesion_and_friction_soften_with_the_bond(far, sigma):
    _, history = pull([far * U_0])
    b = bond(far * U_0)
    limit = C_LEFT + b * (COHESION - C_LEFT) - sigma * (FRICTION_LEFT + b * (FRICTION - FRICTION_LEFT))
    stress, after = contact(sigma / K_N, history[0] + 5e-4, history)
    assert stress == pytest.approx((sigma, limit), rel=1e-12)
    assert after[0] == pytest.approx(5e-4 + history[0] - limit / K_S)
    # just below, no slip
    shear = history[0] + 0.999 * limit / K_S
    assert contact(sigma / K_N, shear, history)[1] == history


def test_a_softening_contact_shears_in_tension_and_an_open_one_slides_freely():
    half = 0.5 * (U_0 + W_C)
    (sigma, tau), history = contact(half, 1e-3)
    limit = 0.5 * (COHESION + C_LEFT) - 0.5 * F_T * 0.5 * (FRICTION + FRICTION_LEFT)
    assert sigma == pytest.approx(0.5 * F_T)
    assert tau == pytest.approx(limit)
    stress, history = contact(1.1 * W_C, 2e-3, history)
    assert stress == (0.0, 0.0)
    assert history[0] == 2e-3
    # closed again there is friction, and the residual cohesion
    stress, _ = contact(-1e6 / K_N, 3e-3, history)
    assert stress == pytest.approx((-1e6, C_LEFT + FRICTION_LEFT * 1e6))


@pytest.mark.parametrize("psi", [0.2, 0.5])
@pytest.mark.parametrize("opening", [-3 * U_0, 0.2 * U_0, 3 * U_0, 6 * U_0])
@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_slip_during_softening_converges_on_the_limit(psi, opening, direction):
    history = pull([4 * U_0])[1]
    for _ in range(200):
        (sigma, tau), history = contact(opening, direction * 5e-5, history, psi=psi)
    slip, dilatant_opening, cracked, kappa = history
    assert cracked
    assert kappa == max(opening, 4 * U_0)
    assert dilatant_opening == pytest.approx(psi * abs(slip), rel=1e-9)
    u, b = opening - dilatant_opening, bond(kappa)
    assert sigma == pytest.approx(K_N * u if u < 0 else F_T * b / kappa * u, rel=1e-9)
    friction = FRICTION_LEFT + b * (FRICTION - FRICTION_LEFT)
    assert tau == pytest.approx(direction * (C_LEFT + b * (COHESION - C_LEFT) - sigma * friction), rel=1e-9)
    # a fixed point
    stress, again = contact(opening, direction * 5e-5, history, psi=psi)
    assert stress == pytest.approx((sigma, tau), rel=1e-12)
    assert again == pytest.approx(history, rel=1e-12)


def test_what_dilation_opens_is_no_crack():
    """The bond softens with the opening beyond dilation."""
    dilatant_opening = 7 * U_0
    stress, history = contact(dilatant_opening + 3 * U_0, 0.0, (0.0, dilatant_opening, False, 0.0), psi=0.2)
    assert stress[0] == pytest.approx(F_T * bond(3 * U_0))
    assert history == pytest.approx((0.0, dilatant_opening, True, 3 * U_0))


def by_branches(opening, shear, slip, cracked, kappa, brittle):
    """Return (sigma, tau), slip, cracked, opened, by the law on paper; without dilation."""
    if opening > U_0:
        cracked = True
    if cracked:
        kappa = max(kappa, opening)
    b = bond(kappa) if cracked else 1.0
    if opening <= 0 or not cracked:
        sigma = K_N * opening
    elif b > 0:
        sigma = F_T * b * opening / kappa
    else:
        return (0.0, 0.0), shear, True, kappa
    limit = C_LEFT + b * (COHESION - C_LEFT) - sigma * (FRICTION_LEFT + b * (FRICTION - FRICTION_LEFT))
    tau = K_S * (shear - slip)
    if abs(tau) <= limit:
        return (sigma, tau), slip, cracked, kappa
    if brittle:
        kappa = max(kappa, W_C)
        if opening > 0:
            return (0.0, 0.0), shear, True, kappa
        limit, cracked = min(abs(tau), C_LEFT - sigma * FRICTION_LEFT), True
    tau = np.copysign(max(limit, 0.0), tau)
    return (sigma, tau), shear - tau / K_S, cracked, kappa


@pytest.mark.quick_cases
@pytest.mark.parametrize("brittle", [False, True])
@pytest.mark.parametrize("swing", [0.7, 2.0, 6.0])
def test_any_path_agrees_with_the_law_written_with_branches(brittle, swing):
    rng = np.random.default_rng(int(10 * swing))
    for _ in range(30):
        history, other = REST, (0.0, False, 0.0)
        for _ in range(50):
            opening, shear = rng.normal(scale=swing * U_0), rng.normal(scale=2e-5)
            stress, history = contact(opening, shear, history, brittle=brittle)
            expected, *other = by_branches(opening, shear, *other, brittle)
            assert stress == pytest.approx(expected, rel=1e-9, abs=1e-6)
            assert (history[0], *history[2:]) == pytest.approx(tuple(other), rel=1e-9, abs=1e-18)
