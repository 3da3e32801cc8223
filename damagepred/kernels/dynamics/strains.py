"""Strain and curvature of elastic blocks with large displacements; see ``damagepred.assembly.elastic_blocks``.

Both act in the frame that rotates with the block. ``strains`` (``BlockStrains`` of solvers/dynamics) is None in walls
of rigid blocks; its ``number`` gives the entry of a body. ``own`` has the displacements of boundary point i per unit
strain and curvature, ``target`` the displacements of the position that it faces on an edge. The
generalised forces are the exact gradient of the contact energy, so that energy, momentum and angular momentum are
conserved. Centrifugal forces on strains and changes of inertia are neglected: both are of the order of the strain.
"""

from damagepred.kernels.dynamics.motion import advance_free
from damagepred.kernels.jit import law, rule

AT_REST = (0.0, 0.0)
"""Strain rate and rate of curvature of the base."""


def unit_displacements(x, y, poisson_ratio, bow_x, bow_y):
    """Displacements of a point of an elastic block along and across its axis, per unit strain and curvature."""
    bow = 0.5 * x**2 + bow_x
    bow = bow + poisson_ratio * (0.5 * y**2 + bow_y)
    return x, -(poisson_ratio * y), -(x * y), bow


_unit_displacements = law(unit_displacements)


@law
def place_on_body(points, i, strains):
    """Position x, y of point i in the frame of its strained body (m)."""
    x, y = points[i].x, points[i].y
    if strains is not None:
        d, shape, now = strains.number[points[i].body], strains.own, strains.displacement
        x += shape[i, 0, 0] * now[d, 0] + shape[i, 0, 1] * now[d, 1]
        y += shape[i, 1, 0] * now[d, 0] + shape[i, 1, 1] * now[d, 1]
    return x, y


@law
def from_strained_edge(along, gap, i, body, strains):
    """Coordinate along, and distance from, the strained edge of a body that point i faces (m), from the rigid ones."""
    if strains is not None:
        d, target, now = strains.number[body], strains.target, strains.displacement
        along -= target[i, 0, 0] * now[d, 0] + target[i, 0, 1] * now[d, 1]
        gap -= target[i, 1, 0] * now[d, 0] + target[i, 1, 1] * now[d, 1]
    return along, gap


@law
def unstrained_place(x, y, body, pose, strains):
    """Position x, y (m) that a point of a body would have if the strain of the body were 0."""
    d, now, c, s = strains.number[body], strains.displacement, pose[body, 2], pose[body, 3]
    arm_x, arm_y = x - pose[body, 0], y - pose[body, 1]
    x_s, y_s, x_k, y_k = _in_body_frame(c * arm_x + s * arm_y, c * arm_y - s * arm_x, d, strains)
    moved_x, moved_y = x_s * now[d, 0] + x_k * now[d, 1], y_s * now[d, 0] + y_k * now[d, 1]
    return x - (c * moved_x - s * moved_y), y - (s * moved_x + c * moved_y)


@law
def _in_body_frame(x, y, d, strains):
    """Displacement x, y of a point per unit strain, and per unit curvature; 0 in a rigid block."""
    c, s = strains.axis[d, 0], strains.axis[d, 1]
    a_s, n_s, a_k, n_k = _unit_displacements(
        c * x + s * y, c * y - s * x, strains.poisson_ratio[d], strains.bow[d, 0], strains.bow[d, 1]
    )
    return c * a_s - s * n_s, s * a_s + c * n_s, c * a_k - s * n_k, s * a_k + c * n_k


@law
def face_place(strains, i, x, y, body, t_x, t_y):
    """Set the position on an edge of a body that point i faces."""
    x_s, y_s, x_k, y_k = _in_body_frame(x, y, strains.number[body], strains)
    target = strains.target
    target[i, 0, 0], target[i, 0, 1] = t_x * x_s + t_y * y_s, t_x * x_k + t_y * y_k
    target[i, 1, 0], target[i, 1, 1] = t_x * y_s - t_y * x_s, t_x * y_k - t_y * x_k


@law
def push_strains(strains, i, a, b, pose, f_x, f_y, normal, shear):
    """Add the generalised forces of contact i on strain and curvature of its bodies a and b.

    The force on a is (``f_x``, ``f_y``); on the edge of b it is ``shear`` along and ``normal`` across (N).
    """
    if strains is not None:
        force, shape, target = strains.force, strains.own, strains.target
        x, y = pose[a, 2] * f_x + pose[a, 3] * f_y, pose[a, 2] * f_y - pose[a, 3] * f_x
        on_a, on_b = strains.number[a], strains.number[b]
        for k in range(2):
            force[on_a, k] += shape[i, 0, k] * x + shape[i, 1, k] * y
            force[on_b, k] += target[i, 0, k] * shear + target[i, 1, k] * normal


@rule
def advance_strains(strains, time_step, local_damping, mass_damping, body_terms):
    """Advance strains and curvatures by one step."""
    if strains is not None:
        advance_free(strains, strains.velocity.shape[0], AT_REST, time_step, local_damping, mass_damping, body_terms)
        strains.force[:] = 0.0


@rule
def resist_strains(strains, stiffness_damping, time_step):
    """Add elastic forces and stiffness-proportional damping of the blocks, and the work of damping."""
    if strains is not None:
        force, stiffness, past = strains.force, strains.stiffness, strains.damping
        for d in range(force.shape[0]):
            for k in range(2):
                rate = strains.velocity[d, k]
                damping = stiffness_damping * stiffness[d, k] * rate
                strains.work[0] += 0.5 * time_step * (damping + past[d, k]) * rate
                past[d, k] = damping
                force[d, k] -= stiffness[d, k] * strains.displacement[d, k] + damping
