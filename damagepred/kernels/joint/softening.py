"""Softening of a bond under mixed opening and slip: integrity, secant stiffness and fracture work.

The history variable kappa is the largest equivalent opening, u + beta |slip| with the slip weight beta (as in the
cohesive law of Ortiz and Pandolfi 1999). The integrity, 1 - damage, falls from 1 at kappa_0 = f_t / k_n to 0 at w_c,

    b = exp(-a xi) - xi exp(-a),   xi = (kappa - kappa_0) / (w_c - kappa_0)

linearly with the shape a = 0, and else exponentially, closed by a line as in Hordijk's curve (1991). w_c is such that a
crack dissipates G_f; with a = 0 it is 2 G_f / f_t.
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
    """What softening the joints of a wall need; None is left out of the explicit update at compile time.

    Attributes
    ----------
    exponential : bool or None
        None if all soften linearly.
    """

    exponential: bool | None


def mean_integrity(shape):
    """Return the mean of b between kappa_0 and w_c, for arrays of shapes (1)."""
    a = np.maximum(shape, TINY)
    return np.where(shape > 0.0, -np.expm1(-a) / a - 0.5 * exp(-a), 0.5)


@law
def linear_integrity(parameters, kappa):
    """Return the integrity b of a bond that has cracked and softens linearly, 0 if it is brittle: 1 - xi.

    Parameters
    ----------
    parameters : JointParameters
        Of the joint.
    kappa : float
        History variable (m).
    """
    integrity = (parameters.critical_opening - kappa) * parameters.damage_rate
    integrity = integrity if integrity > 0.0 else 0.0
    return integrity if integrity < 1.0 else 1.0


@law
def integrity_of(parameters, kappa):
    """Return the integrity b of a bond that has cracked, 0 if it is brittle.

    Parameters
    ----------
    parameters, kappa
        As ``linear_integrity``.
    """
    a, linear = parameters.softening_shape, linear_integrity(parameters, kappa)
    return linear if a == 0.0 or linear == 0.0 else exp(-a * (1.0 - linear)) - (1.0 - linear) * exp(-a)


@law
def softening_slope(parameters, kappa):
    """Return db/dkappa (1/m) of a bond that softens, 0 once it is exhausted.

    Parameters
    ----------
    parameters, kappa
        As ``linear_integrity``.
    """
    a, linear = parameters.softening_shape, linear_integrity(parameters, kappa)
    slope = 1.0 if a == 0.0 else a * exp(-a * (1.0 - linear)) + exp(-a)
    return -slope * parameters.damage_rate if linear > 0.0 else 0.0


@law
def degraded(integrity, intact, residual):
    """Return a strength between its residual and its intact value.

    Parameters
    ----------
    integrity : float
        b (1).
    intact, residual : float
        The strength at b = 1 and at b = 0.
    """
    return integrity * intact + (1.0 - integrity) * residual


@law
def kappa_before_slip(parameters, cracked, kappa, e):
    """Return kappa at an opening, before further slip (m).

    Parameters
    ----------
    parameters : JointParameters
        Of the joint.
    cracked : bool
        Whether the bond softens already.
    kappa, e : float
        History variable, and opening less dilatant opening (m).
    """
    kappa_0 = parameters.tensile_strength / parameters.normal_stiffness
    return max(kappa, e, kappa_0) if cracked else kappa_0


@law
def updated_kappa(parameters, cracked, kappa, e, slip, dilatancy):
    """Return kappa (m) of a softening bond after an increment, and whether the bond softens then.

    Parameters
    ----------
    parameters, cracked, kappa, e
        As ``kappa_before_slip``.
    slip, dilatancy : float
        Increments of plastic slip and dilatant opening (m).
    """
    if parameters.slip_weight > 0.0:
        if cracked or (slip != 0.0 and e <= parameters.tensile_strength / parameters.normal_stiffness):
            return kappa_before_slip(parameters, cracked, kappa, e) + parameters.slip_weight * abs(slip), True
    elif cracked and parameters.critical_opening > 0.0:
        return kappa_before_slip(parameters, cracked, kappa, e - dilatancy), True
    return kappa, cracked


@law
def secant_stiffness(parameters, kappa, integrity):
    """Return the stiffness of a softened bond in tension (Pa/m).

    Parameters
    ----------
    parameters : JointParameters
        Of the joint.
    kappa, integrity : float
        History variable, not 0 (m), and b (1).
    """
    return parameters.tensile_strength * integrity / kappa


@law
def softening_work(parameters, kappa):
    """Return the work that opening to kappa has dissipated (J/m2): the area under the curve less the elastic rest.

    Parameters
    ----------
    parameters : JointParameters
        Of the joint.
    kappa : float
        History variable, at least kappa_0 (m).
    """
    f_t, w_c, a = parameters.tensile_strength, parameters.critical_opening, parameters.softening_shape
    kappa_0, reached = f_t / parameters.normal_stiffness, min(kappa, w_c)
    sigma, xi = f_t * integrity_of(parameters, reached), (reached - kappa_0) * parameters.damage_rate
    twice = (f_t + sigma) * (reached - kappa_0)  # the area beyond kappa_0
    if a > 0.0:
        twice = 2.0 * f_t * ((1.0 - exp(-a * xi)) / a - 0.5 * xi * xi * exp(-a)) / parameters.damage_rate
    return 0.5 * (f_t * kappa_0 + twice - sigma * reached)
