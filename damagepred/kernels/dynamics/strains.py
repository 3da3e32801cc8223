"""Strain and curvature of elastic blocks that move as far as they like; see ``damagepred.assembly.elastic_blocks``.

The two act in the frame that turns with the block. A point of it has moved by its own displacement for a unit of each
(``own``), and so has the place on the edge that it faces (``target``). Both stay the same while it faces that edge. The
generalised forces are the work of the contact's force on these displacements: the exact gradient of its energy, so
that energy, momentum and angular momentum are conserved. The centrifugal force on strains, and what they change of the
block's inertia, are left out: both are of the order of the strain.
"""

from damagepred.kernels.dynamics.motion import advance_free
from damagepred.kernels.jit import law, rule

AT_REST = (0.0, 0.0)
"""Strain rate and rate of curvature of the base."""


def unit_displacements(x, y, poisson_ratio, bow_x, bow_y):
    """Return the displacement of a place of an elastic block, for numbers or arrays.

    Parameters
    ----------
    x, y : float
        The place in axes of the block (m).
    poisson_ratio : float
        Contraction across the axis over the strain along it (1).
    bow_x, bow_y : float
        -b^2/24 and -h^2/24 for a place (m2); for the mean along an edge, with the squares of its length along either
        axis added.

    Returns
    -------
    tuple of float
        Along and across the axis, for a unit strain (m); along and across for a unit curvature (m2).
    """
    bow = 0.5 * x**2 + bow_x
    bow = bow + poisson_ratio * (0.5 * y**2 + bow_y)
    return x, -(poisson_ratio * y), -(x * y), bow


_unit_displacements = law(unit_displacements)


@law
def place_on_body(points, i, strains):
    """Return the place x, y of point i in the frame of its body (m).

    Parameters
    ----------
    points : array of record
        ``POINT``.
    i : int
        The point.
    strains : BlockStrains or None
        See ``damagepred.solvers.dynamics.strains``; None if no block is elastic.
    """
    x, y = points[i].x, points[i].y
    if strains is not None:
        d, own, now = strains.number[points[i].body], strains.own, strains.displacement
        x += own[i, 0, 0] * now[d, 0] + own[i, 0, 1] * now[d, 1]
        y += own[i, 1, 0] * now[d, 0] + own[i, 1, 1] * now[d, 1]
    return x, y


@law
def from_strained_edge(along, gap, i, body, strains):
    """Return coordinate and distance of point i relative to the place on the edge, which moves with its body (m).

    Parameters
    ----------
    along, gap : float
        Relative to the edge of the unstrained body (m).
    i, body : int
        The point, and the body of the edge.
    strains : BlockStrains or None
        As for ``place_on_body``.
    """
    if strains is not None:
        d, target, now = strains.number[body], strains.target, strains.displacement
        along -= target[i, 0, 0] * now[d, 0] + target[i, 0, 1] * now[d, 1]
        gap -= target[i, 1, 0] * now[d, 0] + target[i, 1, 1] * now[d, 1]
    return along, gap


@law
def unstrained_place(x, y, body, pose, strains):
    """Return the place x, y (m) that would be at the given one if its body were not strained.

    Parameters
    ----------
    x, y : float
        Given place (m).
    body : int
        The body.
    pose : array (bodies, 4)
        x, y (m), cosine and sine of the rotation of each body.
    strains : BlockStrains
        See ``place_on_body``.
    """
    d, now, c, s = strains.number[body], strains.displacement, pose[body, 2], pose[body, 3]
    arm_x, arm_y = x - pose[body, 0], y - pose[body, 1]
    x_s, y_s, x_k, y_k = _in_body_frame(c * arm_x + s * arm_y, c * arm_y - s * arm_x, d, strains)
    moved_x, moved_y = x_s * now[d, 0] + x_k * now[d, 1], y_s * now[d, 0] + y_k * now[d, 1]
    return x - (c * moved_x - s * moved_y), y - (s * moved_x + c * moved_y)


@law
def _in_body_frame(x, y, d, strains):
    """Return displacement x, y of a place for a unit strain, and for a unit curvature; 0 in a rigid block."""
    c, s = strains.axis[d, 0], strains.axis[d, 1]
    a_s, n_s, a_k, n_k = _unit_displacements(
        c * x + s * y, c * y - s * x, strains.poisson_ratio[d], strains.bow[d, 0], strains.bow[d, 1]
    )
    return c * a_s - s * n_s, s * a_s + c * n_s, c * a_k - s * n_k, s * a_k + c * n_k


@law
def face_place(strains, i, x, y, body, t_x, t_y):
    """Let point i face a place on an edge of a body from now on.

    Parameters
    ----------
    strains : BlockStrains
        ``target`` is changed.
    i : int
        The point.
    x, y : float
        Place in the body's frame (m).
    body : int
        The body.
    t_x, t_y : float
        Direction of the edge in that frame.
    """
    x_s, y_s, x_k, y_k = _in_body_frame(x, y, strains.number[body], strains)
    target = strains.target
    target[i, 0, 0], target[i, 0, 1] = t_x * x_s + t_y * y_s, t_x * x_k + t_y * y_k
    target[i, 1, 0], target[i, 1, 1] = t_x * y_s - t_y * x_s, t_x * y_k - t_y * x_k


@law
def push_strains(strains, i, a, b, pose, f_x, f_y, normal, shear):
    """Add the generalised forces of a contact on strain and curvature of its two bodies.

    Parameters
    ----------
    strains : BlockStrains or None
        As for ``place_on_body``; ``force`` is added to.
    i, a, b : int
        The point, its body, and that of the edge it faces.
    pose : array (bodies, 4)
        x, y (m), cosine and sine of the rotation of each body.
    f_x, f_y : float
        Force on body a (N).
    normal, shear : float
        Force on body b along the outward normal of the edge and along the edge (N).
    """
    if strains is not None:
        force, own, target = strains.force, strains.own, strains.target
        x, y = pose[a, 2] * f_x + pose[a, 3] * f_y, pose[a, 2] * f_y - pose[a, 3] * f_x
        on_a, on_b = strains.number[a], strains.number[b]
        for k in range(2):
            force[on_a, k] += own[i, 0, k] * x + own[i, 1, k] * y
            force[on_b, k] += target[i, 0, k] * shear + target[i, 1, k] * normal


@rule
def advance_strains(strains, time_step, local_damping, mass_damping, body_terms):
    """Advance strains and curvatures by one step, as ``advance_bodies``.

    Parameters
    ----------
    strains : BlockStrains or None
        As for ``place_on_body``.
    time_step, local_damping, mass_damping, body_terms
        See ``damagepred.kernels.dynamics.motion.advance_bodies``.
    """
    if strains is not None:
        advance_free(strains, strains.velocity.shape[0], AT_REST, time_step, local_damping, mass_damping, body_terms)
        strains.force[:] = 0.0


@rule
def resist_strains(strains, stiffness_damping, time_step):
    """Add the elastic forces of the blocks and their stiffness-proportional damping, and count its work.

    Parameters
    ----------
    strains : BlockStrains or None
        As for ``place_on_body``; ``force`` is added to.
    stiffness_damping : float
        Damping force over the rate of the elastic force (s).
    time_step : float
        dt (s).
    """
    if strains is not None:
        force, stiffness, past = strains.force, strains.stiffness, strains.damping
        for d in range(force.shape[0]):
            for k in range(2):
                rate = strains.velocity[d, k]
                damping = stiffness_damping * stiffness[d, k] * rate
                strains.work[0] += 0.5 * time_step * (damping + past[d, k]) * rate
                past[d, k] = damping
                force[d, k] -= stiffness[d, k] * strains.displacement[d, k] + damping
