"""Forces between bodies that move as far as they like: points on the faces of blocks against the edges of others.

A boundary point is a material point on the face of a block with the area it stands for. It is measured in the frame of
the edge it faces: how far it is from the edge's line is the opening u_n, its way along the edge the shear u_s. With
tension positive the joint law gives sigma and tau from them; the force sigma A along that edge's normal and tau A along
the edge acts at the point's present place on the one body, and the opposite one, at the same place, on the other. So
momentum and angular momentum are kept exactly, and while the joint is elastic the force is the exact gradient of
A (k_n u_n^2 + k_s u_s^2) / 2 with respect to both poses: whatever turns with both of them costs nothing.

The status of a point is one of three:

- BONDED: it faces the edge that it was joined to at first, by mortar or by lying on it. It does so while the bond
  holds, and after that until it opens by ``release_opening`` or passes the end of the edge.
- TOUCHING: it faces an edge met later. A point inside a convex block is in contact with the edge of least penetration
  among those that its face looks at. The penetration d begins at 0, and so does the potential k A d^2 / 2: no rounding
  of corners is needed. The edge is kept until the point parts from it or passes its end by ``edge_overrun``. Then
  contact is detected anew, and pressure and friction are carried over to an edge of nearly the same direction. So a
  block slides over the joints of a course unhindered.
- FREE: it faces nothing.

A point faces one thing at a time, and only what its own face looks at: a corner has two points, one for each of the
faces that meet in it, and the one whose face lies across the edge met takes no part. Energy is never created by a
change of edge: a point that is found behind an edge through which it did not come counts from there (``offset``), and
what it held is lost where it passes an end with nothing beyond.
"""

import numpy as np

from damagepred.kernels.dynamics.strains import (
    face_place,
    from_strained_edge,
    place_on_body,
    push_strains,
    unstrained_place,
)
from damagepred.kernels.jit import law, rule
from damagepred.kernels.joint.explicit_update import explicit_update
from damagepred.kernels.joint.limits import coulomb_limit

FREE, BONDED, TOUCHING = 0, 1, 2
"""Status of a point: what it faces."""
FRICTION, RELEASED, FRACTURE, DASHPOT, JOINT_TERMS = 0, 1, 2, 3, 4
"""What is counted while points act (J): work of friction, energy set free, work of softening, of stiffness damping."""

POINT = np.dtype(
    [
        ("body", "i8"),
        ("own_edge", "i8"),
        ("x", "f8"),
        ("y", "f8"),
        ("area", "f8"),
        ("edge_overrun", "f8"),
        ("release_opening", "f8"),
        ("law", "i8"),
        ("status", "i8"),
        ("target", "i8"),
        ("anchor", "f8"),
        ("offset", "f8"),
        ("searched", "i8"),
        ("slip", "f8"),
        ("dilatant_opening", "f8"),
        ("cracked", "f8"),
        ("kappa", "f8"),
        ("opening", "f8"),
        ("shear", "f8"),
        ("sigma", "f8"),
        ("tau", "f8"),
        ("damping_n", "f8"),
        ("damping_s", "f8"),
    ]
)
"""A boundary point: its body and place there (m), the edge it lies on, its area (m2), how far it may pass an end and
how far part before it is free (m), its law; what it faces, where shear counts from, what is added to the opening (m),
whether its neighbours have been searched; history variables of the law; opening and shear (m), stresses, and damping
stresses (Pa) of the last step."""

EDGE = np.dtype(
    [
        ("body", "i8"),
        ("polygon", "i8"),
        ("x", "f8"),
        ("y", "f8"),
        ("along_x", "f8"),
        ("along_y", "f8"),
        ("low", "f8"),
        ("length", "f8"),
    ]
)
"""An edge of a block: its body and block. In that body's frame the end from which the way along it counts (m), and its
direction, clockwise round the block: the outward normal is (-along_y, along_x). Then where it ends on the way, low and
length (m): 0 and its length, except for the ground, which extends to either side."""


@law
def _edge_coordinates(points, i, edges, e, pose, strains):
    """Return the coordinates of point i in the frame of edge e.

    Returns
    -------
    tuple of float
        Lever arms x, y from the centroids of the point's body and of the edge's (m); coordinate along the edge and
        signed distance from its line, outside positive (m); direction of the edge.
    """
    a, b = points[i].body, edges[e].body
    x, y = place_on_body(points, i, strains)
    ca, sa = pose[a, 2], pose[a, 3]
    arm_ax, arm_ay = ca * x - sa * y, sa * x + ca * y
    at_x, at_y = pose[a, 0] + arm_ax, pose[a, 1] + arm_ay
    arm_bx, arm_by = at_x - pose[b, 0], at_y - pose[b, 1]
    cb, sb = pose[b, 2], pose[b, 3]
    local_x, local_y = cb * arm_bx + sb * arm_by - edges[e].x, cb * arm_by - sb * arm_bx - edges[e].y
    t_x, t_y = edges[e].along_x, edges[e].along_y
    along = t_x * local_x + t_y * local_y
    gap = t_x * local_y - t_y * local_x
    along, gap = from_strained_edge(along, gap, i, b, strains)
    return arm_ax, arm_ay, arm_bx, arm_by, along, gap, cb * t_x - sb * t_y, sb * t_x + cb * t_y


@rule
def signed_distances(at_x, at_y, own_x, own_y, bodies, polygon, pose, strains):
    """Return the signed distances of a place on a face from the edges of one convex block.

    Parameters
    ----------
    at_x, at_y : float
        The place (m).
    own_x, own_y : float
        Direction of the face it lies on, a unit vector.
    bodies : BodyArrays
        See ``contact_forces``.
    polygon : int
        The block.
    pose : array (bodies, 4)
        x, y (m), cosine and sine of the rotation of each body.
    strains : BlockStrains or None
        See ``contact_forces``.

    Returns
    -------
    faced : float
        Largest signed distance from the edges that the face looks at (m); inside it is minus the least depth.
    which : int
        The edge it belongs to, -1 if the face looks at none.
    others : float
        Largest signed distance from the other edges (m).
    """
    edges, last = bodies.edges, bodies.first_edge[polygon + 1]
    faced, others, which = -np.inf, -np.inf, -1
    if strains is not None:  # an elastic block is one body
        at_x, at_y = unstrained_place(at_x, at_y, edges[last - 1].body, pose, strains)
    for e in range(bodies.first_edge[polygon], last):
        b = edges[e].body
        arm_x, arm_y = at_x - pose[b, 0], at_y - pose[b, 1]
        cb, sb = pose[b, 2], pose[b, 3]
        local_x, local_y = cb * arm_x + sb * arm_y - edges[e].x, cb * arm_y - sb * arm_x - edges[e].y
        t_x, t_y = edges[e].along_x, edges[e].along_y
        distance = t_x * local_y - t_y * local_x
        looks = (cb * t_x - sb * t_y) * own_x + (sb * t_x + cb * t_y) * own_y
        if looks < -bodies.facing_cosine:
            if distance > faced:
                faced, which = distance, e
        elif distance > others:
            others = distance
    return faced, which, others


@law
def face_frame(points, i, edges, pose, strains):
    """Return the position x, y of point i (m), and the direction of its face, a unit vector.

    Parameters
    ----------
    points, edges : array of record
        ``POINT``, ``EDGE``.
    i : int
        The point.
    pose : array (bodies, 4)
        x, y (m), cosine and sine of the rotation of each body.
    strains : BlockStrains or None
        See ``contact_forces``.
    """
    a, own = points[i].body, points[i].own_edge
    ca, sa = pose[a, 2], pose[a, 3]
    x, y = place_on_body(points, i, strains)
    t_x, t_y = edges[own].along_x, edges[own].along_y
    return pose[a, 0] + ca * x - sa * y, pose[a, 1] + sa * x + ca * y, ca * t_x - sa * t_y, sa * t_x + ca * t_y


@rule
def _detect_contact(bodies, i, neighbours, pose, strains, pressed, sheared, old_x, old_y):
    """Detect contact of a free point with a neighbouring block, and start it; return whether there is one.

    The point touches the edge of least penetration (node-to-segment contact, Wriggers 2006).
    """
    p = bodies.points[i]
    at_x, at_y, own_x, own_y = face_frame(bodies.points, i, bodies.edges, pose, strains)
    found, deepest, came_from = -1, np.inf, 0.0
    for k in range(neighbours.first[i], neighbours.first[i + 1]):
        gap, e, others = signed_distances(at_x, at_y, own_x, own_y, bodies, neighbours.polygon[k], pose, strains)
        before = neighbours.distance[k] if (p.searched != 0) & (neighbours.edge[k] == e) else min(gap, 0.0)
        neighbours.distance[k] = gap
        neighbours.edge[k] = e
        # half the way of a step ahead: what is met within it presses already, see ``contact_forces``
        if (e < 0) | (gap >= 0.5 * abs(gap - before)) | (gap >= deepest):
            continue
        # through the face itself, or it was behind its line already and came from the side, and is inside by now
        if (before > 0.0) & (others < p.edge_overrun) | (others < gap):
            found, deepest, came_from = e, gap, before
    p.searched = 1
    if found < 0:
        return False
    if strains is not None:
        edge = bodies.edges[found]
        b = edge.body
        arm_x, arm_y, c, s = at_x - pose[b, 0], at_y - pose[b, 1], pose[b, 2], pose[b, 3]
        face_place(strains, i, c * arm_x + s * arm_y, c * arm_y - s * arm_x, b, edge.along_x, edge.along_y)
    _, _, _, _, along, gap, t_x, t_y = _edge_coordinates(bodies.points, i, bodies.edges, found, pose, strains)
    p.law = p.law | 1
    joint = bodies.laws[p.law]
    continues = pressed < 0.0 and t_x * old_x + t_y * old_y > bodies.continuation_cosine
    p.target = found
    p.status = TOUCHING
    p.searched = 0
    p.offset = 0.0 if came_from > 0.0 else max(-gap + (pressed if continues else 0.0), 0.0)
    p.anchor = along - (sheared * joint.shear_compliance if continues else 0.0)
    p.slip = 0.0
    p.dilatant_opening = 0.0
    p.kappa = 0.0
    p.cracked = 1.0
    p.opening = came_from if came_from > 0.0 else gap + p.offset
    p.shear = along - p.anchor
    p.sigma = joint.normal_stiffness * pressed if continues else 0.0
    p.tau = sheared if continues else 0.0
    p.damping_n = 0.0
    p.damping_s = 0.0
    return True


@rule
def _release_contact(bodies, i, neighbours, pose, strains, joint_terms, along, gap, t_x, t_y, search):
    """Release a point that passed the end of its edge, and detect its next contact; return whether there is one.

    The elastic energy that the next contact does not take over is counted as released.
    """
    p = bodies.points[i]
    joint = bodies.laws[p.law]
    u_n, u_s = gap + p.offset, along - p.anchor
    # in tension it unloads along the secant
    normal_energy = p.sigma * p.sigma * (1.0 / joint.normal_stiffness)
    if p.sigma > 0.0:
        normal_energy = p.sigma * (p.opening - p.dilatant_opening)
    before = 0.5 * (normal_energy + p.tau * p.tau * joint.shear_compliance)
    work = 0.5 * (p.sigma * (u_n - p.opening) + p.tau * (u_s - p.shear))
    pressed = min(u_n - p.dilatant_opening, 0.0) if p.sigma < 0.0 else 0.0
    p.status = FREE
    p.searched = 0
    after = 0.0
    met = search and _detect_contact(bodies, i, neighbours, pose, strains, pressed, p.tau, t_x, t_y)
    if met:
        joint = bodies.laws[p.law]
        after = 0.5 * (p.sigma * p.sigma * (1.0 / joint.normal_stiffness) + p.tau * p.tau * joint.shear_compliance)
    else:
        p.law = p.law | 1
        p.sigma = 0.0
        p.tau = 0.0
        p.damping_n = 0.0
        p.damping_s = 0.0
    joint_terms[RELEASED] += p.area * (before + work - after)
    return met


@law
def _exceeds_limits(p, joint, sigma, tau, special, softening):
    """Return whether the elastic predictor of a point needs a correction by limits, softening or a cap."""
    cracked = p.cracked != 0.0
    f_t = joint.residual_tensile_strength if cracked else joint.tensile_strength
    cohesion = joint.residual_cohesion if cracked else joint.cohesion
    friction = joint.residual_friction if cracked else joint.friction
    exceeds = (sigma > f_t) | (abs(tau) > coulomb_limit(cohesion, friction, sigma))
    if softening is not None:
        exceeds = exceeds | (cracked & (joint.critical_opening > 0.0))
    if special is not None:
        exceeds = exceeds | (joint.compressive_strength < np.inf)
    return exceeds


@law
def _return_to_limits(p, joint, pressed, u_n, u_s, special, softening):
    """Return sigma, tau (Pa) of a point by the joint law, and its works per area (J/m2); commit its history.

    Returns
    -------
    sigma, tau : float
        Stress (Pa).
    friction_work, fracture_work, released_energy : float
        Of the step (J/m2).
    """
    was_cracked, slip, dilatant_opening, kappa = p.cracked != 0.0, p.slip, p.dilatant_opening, p.kappa
    sigma, tau, p.slip, p.dilatant_opening, cracked, p.kappa = explicit_update(
        pressed, u_s, slip, dilatant_opening, was_cracked, kappa, joint, special, softening
    )
    p.cracked = 1.0 if cracked else 0.0
    mean_sigma, mean_tau = 0.5 * (sigma + p.sigma), 0.5 * (tau + p.tau)
    friction_work = mean_tau * (p.slip - slip) + mean_sigma * (p.dilatant_opening - dilatant_opening)
    softens, snaps = False, False
    if softening is not None:
        w_c = joint.critical_opening
        softens = cracked & (w_c > 0.0) & ((p.sigma > 0.0) | (sigma > 0.0))
        if special is not None:
            # slip that breaks the bond releases its elastic energy
            snaps = joint.brittle_shear & (kappa < w_c) & (p.kappa >= w_c) & (u_n - p.dilatant_opening < w_c)
    if not ((cracked != was_cracked) | softens):
        return sigma, tau, friction_work, 0.0, 0.0
    lost = mean_sigma * (u_n - p.opening - p.dilatant_opening + dilatant_opening)
    lost += 0.5 * p.sigma * (p.opening - dilatant_opening)
    lost -= 0.5 * sigma * (u_n - p.dilatant_opening)
    if softens & (not snaps):
        return sigma, tau, friction_work, lost, 0.0
    return sigma, tau, friction_work, 0.0, lost


@law
def _damping_stress(p, sigma, tau, rate, newly_cracked, no_tension):
    """Return the damping stress (Pa), proportional to the rate of the elastic stress.

    It never pulls a joint that carries no tension.
    """
    if newly_cracked or (no_tension and sigma == 0.0):
        return 0.0, 0.0
    damping_n = rate * (sigma - p.sigma)
    if p.cracked != 0.0 and sigma <= 0.0 and sigma + damping_n > 0.0:
        damping_n = -sigma
    return damping_n, rate * (tau - p.tau)


@law
def _add_force_pair(force, a, b, x, y, moment_a, moment_b):
    """Add a force to body a, the opposite force to body b, and the moments of both."""
    force[a, 0] += x
    force[a, 1] += y
    force[a, 2] += moment_a
    force[b, 0] -= x
    force[b, 1] -= y
    force[b, 2] += moment_b


@rule
def contact_forces(
    bodies, neighbours, pose, force, strains, special, softening, per_step, pressed_per_step, search, joint_terms
):
    """Compute the forces of all contacts on the bodies (penalty contact with the joint law), and commit their history.

    A point that is pressed in one step and not in the next passes the kink of the law somewhere in between. A force
    taken at the end of the step misses part of the impulse, or adds to it, at random. So where the point is nearer to
    the kink than half its way in the last step, the law is given the mean pressure over a step's way about here:
    -(w - u)^2 / (4 w) in place of min(u, 0), with w half that way. What bounces then keeps its energy far better.

    Parameters
    ----------
    bodies : BodyArrays
        Points, edges, laws and cosines; see ``damagepred.solvers.dynamics.body_arrays``.
    neighbours : NamedTuple of arrays
        ``first`` (p + 1,), ``polygon``, ``edge`` and ``distance`` (k,): blocks near each point, and how far the edge
        that its face looks at was last.
    pose : array (bodies, 4)
        x, y (m), cosine and sine of the angle of each body.
    force : array (bodies, 3)
        Force x, y (N) and moment (N m) on each body: added to.
    strains : BlockStrains or None
        Of elastic blocks, whose ``force`` is added to; None if there are none: left out at compile time.
    special : bool or None
        None if no joint dilates, breaks or softens by slip or has a cap: left out at compile time.
    softening : Softening or None
        None if no bond softens: left out at compile time.
    per_step : float
        Stiffness-proportional damping over the time step (1).
    pressed_per_step : float
        The same of contacts without tensile strength, in addition.
    search : bool
        Whether points may touch blocks that they were not bonded to.
    joint_terms : array (JOINT_TERMS,)
        Added to.
    """
    points, edges = bodies.points, bodies.edges
    friction_work, released_energy, fracture_work, damping_work = 0.0, 0.0, 0.0, 0.0
    # points of one joint follow each other: their forces on its two bodies are summed before they are added
    last_a, last_b = 0, 0
    a_x, a_y, a_m, b_m = 0.0, 0.0, 0.0, 0.0
    for i in range(points.size):
        p = points[i]
        if p.status == FREE:
            if not search or neighbours.first[i] == neighbours.first[i + 1]:
                continue
            if not _detect_contact(bodies, i, neighbours, pose, strains, 0.0, 0.0, 0.0, 0.0):
                continue
        ax, ay, bx, by, along, gap, t_x, t_y = _edge_coordinates(points, i, edges, p.target, pose, strains)
        edge = edges[p.target]
        if (along < edge.low - p.edge_overrun) | (along > edge.length + p.edge_overrun):
            if not _release_contact(bodies, i, neighbours, pose, strains, joint_terms, along, gap, t_x, t_y, search):
                continue
            ax, ay, bx, by, along, gap, t_x, t_y = _edge_coordinates(points, i, edges, p.target, pose, strains)
        joint = bodies.laws[p.law]
        u_n, u_s = gap + p.offset, along - p.anchor
        moved, was_cracked = u_n - p.opening, p.cracked != 0.0
        elastic_opening, half_step = u_n - p.dilatant_opening, 0.5 * abs(moved)
        no_tension = was_cracked & (joint.residual_tensile_strength == 0.0)
        at_kink = no_tension & (abs(elastic_opening) < half_step)
        if softening is not None:
            no_tension = no_tension & (p.kappa >= joint.critical_opening)

        # elastic predictor: most contacts need no more
        sigma, tau = joint.normal_stiffness * elastic_opening, joint.shear_stiffness * (u_s - p.slip)
        if _exceeds_limits(p, joint, sigma, tau, special, softening) | at_kink:
            pressed = u_n
            if no_tension & at_kink:
                below = half_step - elastic_opening
                pressed = p.dilatant_opening - below * below / (4.0 * half_step)
            sigma, tau, by_slip, by_softening, released = _return_to_limits(
                p, joint, pressed, u_n, u_s, special, softening
            )
            friction_work += p.area * by_slip
            fracture_work += p.area * by_softening
            released_energy += p.area * released
        cracked = p.cracked != 0.0

        total_n, total_s = sigma, tau
        rate = per_step + (pressed_per_step if no_tension else 0.0)
        if rate > 0.0:
            damping_n, damping_s = _damping_stress(p, sigma, tau, rate, cracked != was_cracked, no_tension)
            moved_s = u_s - p.shear
            damping_work += 0.5 * p.area * ((damping_n + p.damping_n) * moved + (damping_s + p.damping_s) * moved_s)
            p.damping_n = damping_n
            p.damping_s = damping_s
            total_n += damping_n
            total_s += damping_s

        p.opening = u_n
        p.shear = u_s
        p.sigma = sigma
        p.tau = tau
        if sigma == 0.0 and tau == 0.0:
            if cracked and elastic_opening > (p.release_opening if p.status == BONDED else half_step):
                p.status = FREE
                p.searched = 0
                p.law = p.law | 1
            continue
        a, b = p.body, edges[p.target].body
        total_n *= p.area
        total_s *= p.area
        f_x, f_y = total_n * t_y - total_s * t_x, -total_n * t_x - total_s * t_y
        if (a != last_a) | (b != last_b):
            _add_force_pair(force, last_a, last_b, a_x, a_y, a_m, b_m)
            last_a, last_b = a, b
            a_x, a_y, a_m, b_m = 0.0, 0.0, 0.0, 0.0
        a_x += f_x
        a_y += f_y
        a_m += ax * f_y - ay * f_x
        b_m -= bx * f_y - by * f_x
        push_strains(strains, i, a, b, pose, f_x, f_y, total_n, total_s)
    _add_force_pair(force, last_a, last_b, a_x, a_y, a_m, b_m)
    joint_terms[FRICTION] += friction_work
    joint_terms[RELEASED] += released_energy
    joint_terms[FRACTURE] += fracture_work
    joint_terms[DASHPOT] += damping_work
