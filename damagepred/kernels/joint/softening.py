"""Softening of a bond under mixed opening and slip: integrity, secant stiffness and fracture work.

The history variable kappa is the largest equivalent opening, u + beta |slip| with the slip weight beta (as in the
cohesive law of Ortiz and Pandolfi 1999). The integrity, 1 - damage, falls from 1 at kappa_0 = f_t / k_n to 0 at w_c,

    b = exp(-a xi) - xi exp(-a),   xi = (kappa - kappa_0) / (w_c - kappa_0)

linearly with the shape a = 0, otherwise exponentially, closed by a line as in Hordijk's curve (1991). w_c is chosen so
that a crack dissipates G_f; with a = 0 it is 2 G_f / f_t.
"""

from typing import NamedTuple

import numpy as np
from numpy import exp

from damagepred.kernels.jit import law

TINY = 1e-100
"""Keeps a divisor that is an opening from being 0 (m)."""
EXPONENTIAL_SHAPE = 5.0
"""Shape a of exponential softening: the curve begins as exp(-f_t w / G_f), and its tail beyond w_c is left out."""


class Softening(NamedTuple):
    """Softening law of a wall's joints; the compiler omits the exponential law if it is None."""

    exponential: bool | None  # None: all bonds soften linearly


def mean_integrity(shape):
    """Mean of b between kappa_0 and w_c, for arrays of shapes (1)."""
    a = np.maximum(shape, TINY)
    return np.where(shape > 0.0, -np.expm1(-a) / a - 0.5 * exp(-a), 0.5)


@law
def linear_integrity(parameters, kappa):
    """Integrity b of a bond that has cracked and softens linearly, 0 if it is brittle: 1 - xi."""
    integrity = (parameters.critical_opening - kappa) * parameters.damage_rate
    integrity = integrity if integrity > 0.0 else 0.0
    return integrity if integrity < 1.0 else 1.0


@law
def integrity_of(parameters, kappa):
    """Integrity b of a bond that has cracked, 0 if it is brittle."""
    a, linear = parameters.softening_shape, linear_integrity(parameters, kappa)
    return linear if a == 0.0 or linear == 0.0 else exp(-a * (1.0 - linear)) - (1.0 - linear) * exp(-a)


@law
def softening_slope(parameters, kappa):
    """Slope db/dkappa (1/m) of a softening bond, 0 once it is exhausted."""
    a, linear = parameters.softening_shape, linear_integrity(parameters, kappa)
    slope = 1.0 if a == 0.0 else a * exp(-a * (1.0 - linear)) + exp(-a)
    return -slope * parameters.damage_rate if linear > 0.0 else 0.0


@law
def degraded(integrity, intact, residual):
    """Strength between its residual and its intact value."""
    return integrity * intact + (1.0 - integrity) * residual


@law
def kappa_before_slip(parameters, kappa, e):
    """Kappa (m) at an opening, before further slip; kappa_0 while the bond is intact."""
    return max(kappa, e, parameters.tensile_strength / parameters.normal_stiffness)


@law
def updated_kappa(parameters, cracked, kappa, e, slip, dilatancy):
    """Kappa (m) of a softening bond after an increment, and whether the bond is softening."""
    if parameters.critical_opening == 0.0:
        return kappa, cracked
    if parameters.slip_weight > 0.0:
        after = kappa_before_slip(parameters, kappa, e) + parameters.slip_weight * abs(slip)
    else:
        after = kappa_before_slip(parameters, kappa, e - dilatancy)
    if cracked or after > parameters.tensile_strength / parameters.normal_stiffness:
        return after, True
    return kappa, False


@law
def secant_stiffness(parameters, kappa, integrity):
    """Stiffness of a softened bond in tension (Pa/m)."""
    return parameters.tensile_strength * integrity / kappa


@law
def softening_work(parameters, kappa):
    """Work that opening to kappa has dissipated (J/m2): the area under the curve less the elastic rest."""
    f_t, w_c, a = parameters.tensile_strength, parameters.critical_opening, parameters.softening_shape
    kappa_0, reached = f_t / parameters.normal_stiffness, min(kappa, w_c)
    sigma, xi = f_t * integrity_of(parameters, reached), (reached - kappa_0) * parameters.damage_rate
    twice = (f_t + sigma) * (reached - kappa_0)  # the area beyond kappa_0
    if a > 0.0:
        twice = 2.0 * f_t * ((1.0 - exp(-a * xi)) / a - 0.5 * xi * xi * exp(-a)) / parameters.damage_rate
    return 0.5 * (f_t * kappa_0 + twice - sigma * reached)
