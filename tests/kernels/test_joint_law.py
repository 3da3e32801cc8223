"""The law of a contact along paths with known solutions."""

import numpy as np
import pytest

from damagepred.kernels.joint.explicit_update import explicit_update
from tests.kernels.one_joint import one_joint

K_N, K_S = 82e9, 36e9
F_T, COHESION, FRICTION = 0.45e6, 0.375e6, 0.75
REST = (0.0, 0.0, False)  # slip, dilated, cracked


def contact(
    opening,
    shear,
    history=REST,
    *,
    psi=0.0,
    brittle=False,
    strength=(F_T, COHESION, FRICTION),
    residual_strength=(0.0, 0.0, FRICTION),
):
    """Return (sigma, tau) and the new history."""
    parameters = one_joint(K_N, K_S, strength, residual_strength, psi=psi, brittle=brittle)
    sigma, tau, *new, kappa = explicit_update(opening, shear, (*history, 0.0), parameters, True, None)
    assert kappa == 0.0
    return (sigma, tau), tuple(new)


def opening_for(sigma):
    return sigma / K_N


def shear_for(tau):
    return tau / K_S


@pytest.mark.parametrize(("sigma", "tau"), [(-1e6, 0.9e6), (0.4e6, 0.05e6), (-1e5, -2e5), (0.0, 0.0)])
def test_elastic_within_the_limits(sigma, tau):
    stress, history = contact(opening_for(sigma), shear_for(tau))
    assert stress == pytest.approx((sigma, tau), rel=1e-14)
    assert history == REST


def test_tension_breaks_the_bond_and_an_open_joint_slides_freely():
    shear = shear_for(1e4)
    stress, history = contact(opening_for(1.0001 * F_T), shear)
    assert stress == (0.0, 0.0)
    assert history == (shear, 0.0, True)


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_coulomb_slip_both_ways(direction):
    sigma = -1e6
    limit = COHESION - sigma * FRICTION
    shear = direction * shear_for(3 * limit)
    stress, (slip, dilatant_opening, cracked) = contact(opening_for(sigma), shear)
    assert stress == pytest.approx((sigma, direction * limit))
    assert slip == pytest.approx(direction * shear_for(2 * limit))
    assert dilatant_opening == 0.0
    assert not cracked  # Eq. 4 as printed: slip does not break the bond
    # elastic unloading, and slip in the other direction beyond twice the limit
    stress, history = contact(opening_for(sigma), shear - direction * shear_for(limit), (slip, 0.0, False))
    assert stress[1] == pytest.approx(0.0, abs=1e-6 * limit)
    stress, history = contact(opening_for(sigma), shear - direction * shear_for(3 * limit), history)
    assert stress[1] == pytest.approx(-direction * limit)
    assert history[0] == pytest.approx(direction * shear_for(limit))


def test_residual_values():
    residual_strength = (0.1e6, 0.2e6, 0.5)
    (sigma, tau), history = contact(opening_for(1.01 * F_T), 0.0, residual_strength=residual_strength)
    assert (sigma, tau) == (0.0, 0.0)
    stress, history = contact(opening_for(0.05e6), 0.0, history, residual_strength=residual_strength)
    assert stress == pytest.approx((0.05e6, 0.0))  # below the residual tensile strength
    stress, history = contact(opening_for(-1e6), shear_for(2e6), history, residual_strength=residual_strength)
    assert stress == pytest.approx((-1e6, 0.2e6 + 0.5e6))
    assert history[2]


def test_brittle_shear_leaves_residual_values_after_the_first_slip():
    sigma, tau = -1e6, 2e6
    stress, history = contact(opening_for(sigma), shear_for(tau), brittle=True)
    assert stress == pytest.approx((sigma, FRICTION * 1e6))
    assert history[2]
    # in tension below f_t the broken joint opens at once
    stress, history = contact(opening_for(0.3e6), shear_for(1e6), brittle=True)
    assert stress == (0.0, 0.0)
    assert history == (shear_for(1e6), 0.0, True)
    # without slip nothing breaks
    _, history = contact(opening_for(sigma), shear_for(1e6), brittle=True)
    assert history == REST


@pytest.mark.parametrize("direction", [1.0, -1.0])
def test_dilation_compresses_the_joint_and_stays_on_the_limit(direction):
    psi, sigma = 0.3, -1e6
    shear = direction * shear_for(3e6)
    travelled = (3e6 - (COHESION - sigma * FRICTION)) / (K_S + K_N * FRICTION * psi)
    (s, t), (slip, dilatant_opening, _) = contact(opening_for(sigma), shear, psi=psi)
    assert slip == pytest.approx(direction * travelled)
    assert dilatant_opening == pytest.approx(psi * travelled)
    assert s == pytest.approx(sigma - K_N * psi * travelled)
    assert t == pytest.approx(direction * (COHESION - s * FRICTION))
    # the state is a fixed point: the same displacement again changes nothing
    (s2, t2), history = contact(opening_for(sigma), shear, (slip, dilatant_opening, False), psi=psi)
    assert (s2, t2) == pytest.approx((s, t), rel=1e-12)
    assert history == pytest.approx((slip, dilatant_opening, 0.0), rel=1e-12)


@pytest.mark.parametrize("psi", [0.0, 0.5])
def test_beyond_the_apex_shear_vanishes_and_no_more(psi):
    """With f_t above C / tan(phi) tension can pass the apex of the cone, where no shear is left to carry."""
    strength = (2e6, 0.2e6, 0.8)
    (_, tau), (slip, dilatant_opening, _) = contact(opening_for(1e6), shear_for(1e5), psi=psi, strength=strength)
    assert tau == pytest.approx(0.0, abs=1e-9)
    assert slip == pytest.approx(shear_for(1e5))
    assert dilatant_opening == pytest.approx(psi * shear_for(1e5))


def test_at_the_apex_tension_breaks_first():
    apex = COHESION / FRICTION
    stress, history = contact(opening_for(apex * (1 - 1e-9)), shear_for(1e3), strength=(apex, COHESION, FRICTION))
    assert stress[0] == pytest.approx(apex)
    assert stress[1] == pytest.approx(0.0, abs=1e-2)
    assert not history[2]


def test_nan_is_propagated():
    assert np.isnan(contact(np.nan, 0.0)[0][0])
    assert np.isnan(contact(0.0, np.nan)[0][1])


F_C, C_SS = 4e6, 9.0


def capped_contact(opening, shear, history):
    """Return (sigma, tau) and the new history of a joint with a cap."""
    parameters = one_joint(K_N, K_S, (F_T, COHESION, FRICTION), (0.0, 0.0, FRICTION), cap=(F_C, C_SS))
    sigma, tau, *new, _ = explicit_update(opening, shear, (*history, 0.0), parameters, True, None)
    return (sigma, tau), tuple(new)


def test_a_crushed_joint_keeps_its_strength_and_has_closed_for_good():
    history = REST
    for share in (0.5, 1.0, 1.7, 3.0):
        (sigma, _), history = capped_contact(-share * F_C / K_N, 0.0, history)
        assert sigma == pytest.approx(-min(share, 1.0) * F_C, rel=1e-14)
    assert history[1] == pytest.approx(-2.0 * F_C / K_N, rel=1e-14)
    # unloading is elastic from the crushed state
    (sigma, _), history = capped_contact(-2.6 * F_C / K_N, 0.0, history)
    assert sigma == pytest.approx(-0.6 * F_C, rel=1e-12)
    assert history[1] == pytest.approx(-2.0 * F_C / K_N, rel=1e-14)
    (sigma, _), history = capped_contact(-2.0 * F_C / K_N + 0.9 * F_T / K_N, 0.0, history)
    assert sigma == pytest.approx(0.9 * F_T, rel=1e-9), "its bond holds yet"
    (sigma, _), history = capped_contact(-2.0 * F_C / K_N + 1.1 * F_T / K_N, 0.0, history)
    assert sigma == 0.0
    assert history[2]
    # reloading crushes it further
    (sigma, _), history = capped_contact(-4.0 * F_C / K_N, 0.0, history)
    assert sigma == pytest.approx(-F_C, rel=1e-14)
    assert history[1] == pytest.approx(-3.0 * F_C / K_N, rel=1e-14)


@pytest.mark.parametrize("share", [0.0, 0.2, 0.5, 0.8, 0.999, 1.0, 1.5])
@pytest.mark.parametrize("sign", [1.0, -1.0])
def test_a_joint_with_a_cap_slides_on_the_cone_or_on_the_ellipse(share, sign):
    pressure = min(share, 1.0) * F_C
    limit = min(COHESION + pressure * FRICTION, np.sqrt((F_C**2 - pressure**2) / C_SS))
    (sigma, tau), history = capped_contact(-share * F_C / K_N, sign * shear_for(3e6), REST)
    assert sigma == pytest.approx(-pressure, rel=1e-12)
    assert tau == pytest.approx(sign * limit, rel=1e-9, abs=1.0)
    assert history[0] == pytest.approx(sign * shear_for(3e6 - limit), rel=1e-6)
    # slip has not changed the limit
    again, after = capped_contact(-share * F_C / K_N, sign * shear_for(3e6), history)
    assert again == pytest.approx((sigma, tau), rel=1e-9, abs=1.0)
    assert after == pytest.approx(history, rel=1e-6)
