"""Linear softening of a bond under mixed opening and slip: integrity, secant stiffness and fracture work.

The history variable kappa is the largest equivalent opening, u + beta |slip| with the slip weight beta (as in the
cohesive law of Ortiz and Pandolfi 1999, but linear). The integrity, 1 - damage, is

    b = (w_c - kappa) / (w_c - kappa_0),   kappa_0 = f_t / k_n,   w_c = 2 G_f / f_t
"""

from numpy import maximum

from damagepred.kernels.jit import law

TINY = 1e-100
"""Keeps a divisor that is an opening from being 0 (m)."""


@law
def damage_rate(k_n, f_t, critical_opening):
    """Return the damage for each unit of kappa beyond kappa_0, 1 / (w_c - kappa_0) (1/m).

    Parameters
    ----------
    k_n, f_t, critical_opening : float
        Normal stiffness (Pa/m), tensile strength (Pa) and w_c (m).
    """
    return 1.0 / maximum(critical_opening - f_t / k_n, TINY)


@law
def integrity_of(kappa, cracked, critical_opening, rate):
    """Return the integrity b: 1 while intact, 0 where the bond broke at once.

    Parameters
    ----------
    kappa : float
        History variable (m).
    cracked : bool
        As ``joint_law`` has it.
    critical_opening, rate : float
        w_c (m) and ``damage_rate`` (1/m).
    """
    integrity = (critical_opening - kappa) * rate
    integrity = integrity if integrity > 0.0 else 0.0
    return integrity if cracked & (integrity < 1.0) else 1.0


@law
def softened_integrity(kappa, kappa_0, w_c):
    """Return the integrity b of a bond that has begun to soften.

    Parameters
    ----------
    kappa, kappa_0, w_c : float
        History variable, its value at peak, and critical opening (m).
    """
    return min(max((w_c - kappa) / (w_c - kappa_0), 0.0), 1.0)


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
def slip_weight_of(properties, i):
    """Return the slip weight beta of interface i (1), 0 where slip leaves the bond as it is.

    Parameters
    ----------
    properties : NamedTuple of arrays (m,)
        Of the joints.
    i : int
        Interface.
    """
    if properties.critical_slip[i] == 0.0:
        return 0.0
    kappa_0 = properties.tensile_strength[i] / properties.normal_stiffness[i]
    return (properties.critical_opening[i] - kappa_0) / properties.critical_slip[i]


@law
def kappa_before_slip(cracked, kappa, e, kappa_0):
    """Return kappa at an opening, before further slip (m).

    Parameters
    ----------
    cracked : bool
        Whether the bond softens already.
    kappa, e, kappa_0 : float
        History variable, opening less dilatant opening, and kappa at peak (m).
    """
    return max(kappa, e, kappa_0) if cracked else kappa_0


@law
def secant_stiffness(kappa, f_t, k_n, w_c):
    """Return the stiffness of a softened bond in tension (Pa/m).

    Parameters
    ----------
    kappa, f_t, k_n, w_c : float
        History variable (m), tensile strength (Pa), normal stiffness (Pa/m), critical opening (m).
    """
    return f_t * softened_integrity(kappa, f_t / k_n, w_c) / kappa


@law
def softening_work(kappa, f_t, k_n, w_c):
    """Return the work that opening to kappa has dissipated (J/m2): the area under the curve less the elastic rest.

    Parameters
    ----------
    kappa, f_t, k_n, w_c : float
        As ``secant_stiffness``.
    """
    kappa_0, reached = f_t / k_n, min(kappa, w_c)
    sigma = f_t * softened_integrity(reached, kappa_0, w_c)
    return 0.5 * (f_t * kappa_0 + (f_t + sigma) * (reached - kappa_0) - sigma * reached)
