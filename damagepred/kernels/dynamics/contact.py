"""Contact forces of bodies with large displacements: points on the faces of blocks against the edges of others.

A boundary point is a material point on the face of a block with a tributary area A. In the frame of the edge it faces,
its distance from the edge is the opening u_n, its position along the edge the shear u_s. The joint law gives sigma and
tau, tension positive; the force, sigma A along the normal and tau A along the edge, acts at the present position of the
point on both bodies in opposite directions. So momentum and angular momentum are conserved, and the force of an elastic
joint is the exact gradient of A (k_n u_n^2 + k_s u_s^2) / 2 with respect to both poses.

Status of a point:

- BONDED: faces its first edge, by mortar or by support, while the bond holds, and then until it opens by
  ``release_opening`` or passes the end of the edge.
- TOUCHING: faces an edge met later: the edge of least penetration of a convex block among the edges that face it. The
  penetration starts at 0, so corners need no rounding. The point keeps its edge until it separates or passes the end by
  ``edge_overrun``; then contact is detected again, and pressure and friction pass to an edge of nearly the same
  direction, so that a block slides over the joints of a course.
- FREE: faces no edge.

A corner has two points, one per face. A change of edge creates no energy: a point that is already behind its new edge
starts with an ``offset``, and the energy of a point that passes the last edge is released.
"""

import numpy as np

from damagepred.kernels.dynamics.strains import (
    face_place,
    from_strained_edge,
    place_on_body,
    push_strains,
    unstrained_place,
)
from damagepred.kernels.jit import kernel, law, rule
from damagepred.kernels.joint.explicit_update import explicit_update
from damagepred.kernels.joint.limits import coulomb_limit

FACING_COSINE = 0.1
"""Cosine of the angle between two faces that touch, least to count as facing each other (1). 0.1 is 84 degrees."""
CONTINUATION_COSINE = 0.7
"""Cosine of the angle between two edges from which pressure and friction pass from one to the next (1)."""
FREE, BONDED, TOUCHING = 0, 1, 2
"""Status of a point."""
FRICTION, RELEASED, FRACTURE, DASHPOT, JOINT_TERMS = 0, 1, 2, 3, 4
"""Energy terms of points (J): friction, released energy, softening, stiffness damping."""

POINT = np.dtype(
    [(name, "i8") for name in ("body", "own_edge")]
    + [(name, "f8") for name in ("x", "y", "area", "edge_overrun", "release_opening")]
    + [(name, "i8") for name in ("law", "status", "target")]
    + [("anchor", "f8"), ("offset", "f8"), ("searched", "i8")]
    + [(name, "f8") for name in ("slip", "dilatant_opening", "cracked", "kappa")]
    + [(name, "f8") for name in ("opening", "shear", "sigma", "tau", "damping_n", "damping_s")]
)
"""Boundary point: body, own edge, position in the body frame (m), area (m2), overrun and release distances (m), joint
law; target edge, origins of shear and opening (m), whether its neighbours have been searched; history variables;
opening, shear (m), stresses and damping stresses (Pa) of the last step."""

EDGE = np.dtype(
    [("body", "i8"), ("polygon", "i8")] + [(name, "f8") for name in ("x", "y", "along_x", "along_y", "low", "length")]
)
"""Edge of a block: body, block, start in the body frame (m), unit direction clockwise round the block (the outward
normal is (-along_y, along_x)), and coordinates of both ends along it (m)."""


@law
def _edge_coordinates(points, i, edges, e, pose, strains):
    """Arms of point i on both bodies, coordinate and distance from edge e (m), direction of the edge."""
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
    """Largest signed distance (m) from the edges of a convex block facing a point, its edge, and from other edges."""
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
        if looks < -FACING_COSINE:
            if distance > faced:
                faced, which = distance, e
        elif distance > others:
            others = distance
    return faced, which, others


@law
def face_frame(points, i, edges, pose, strains):
    """Position x, y of point i (m), and the direction of its face, a unit vector."""
    a, own_edge = points[i].body, points[i].own_edge
    ca, sa = pose[a, 2], pose[a, 3]
    x, y = place_on_body(points, i, strains)
    t_x, t_y = edges[own_edge].along_x, edges[own_edge].along_y
    return pose[a, 0] + ca * x - sa * y, pose[a, 1] + sa * x + ca * y, ca * t_x - sa * t_y, sa * t_x + ca * t_y


@rule
def _detect_contact(bodies, i, neighbours, pose, strains, pressed, sheared, old_x, old_y):
    """Start contact of point i with the edge of least penetration (node-to-segment, Wriggers 2006); False without any.

    From an edge of direction ``old`` just passed, the closing ``pressed`` (m) and stress ``sheared`` (Pa) go on.
    """
    p = bodies.points[i]
    at_x, at_y, own_x, own_y = face_frame(bodies.points, i, bodies.edges, pose, strains)
    target, deepest, came_from = -1, np.inf, 0.0
    for k in range(neighbours.first[i], neighbours.first[i + 1]):
        gap, e, others = signed_distances(at_x, at_y, own_x, own_y, bodies, neighbours.polygon[k], pose, strains)
        before = neighbours.distance[k] if (p.searched != 0) & (neighbours.edge[k] == e) else min(gap, 0.0)
        neighbours.distance[k] = gap
        neighbours.edge[k] = e
        # half a step ahead: an edge met within it presses already, see ``contact_forces``
        if (e < 0) | (gap >= 0.5 * abs(gap - before)) | (gap >= deepest):
            continue
        # it came through the edge, or from the side behind the edge's line and is inside now
        if (before > 0.0) & (others < p.edge_overrun) | (others < gap):
            target, deepest, came_from = e, gap, before
    p.searched = 1
    if target < 0:
        return False
    if strains is not None:
        edge = bodies.edges[target]
        b = edge.body
        arm_x, arm_y, c, s = at_x - pose[b, 0], at_y - pose[b, 1], pose[b, 2], pose[b, 3]
        face_place(strains, i, c * arm_x + s * arm_y, c * arm_y - s * arm_x, b, edge.along_x, edge.along_y)
    _, _, _, _, along, gap, t_x, t_y = _edge_coordinates(bodies.points, i, bodies.edges, target, pose, strains)
    p.law = p.law | 1
    joint = bodies.laws[p.law]
    continues = pressed < 0.0 and t_x * old_x + t_y * old_y > CONTINUATION_COSINE
    p.target = target
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
    """Release a point that passed the end of its edge, and detect its next contact; True if there is one."""
    # elastic energy that does not pass to the next contact is released
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
    """Whether the elastic predictor of a point needs a correction by limits, softening or a cap."""
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
    """Return mapping of a point beyond its limits: stresses (Pa), and energies (J/m2) of the step; commits its history.

    ``pressed`` is the opening that the law gets, see ``contact_forces``. The energies are friction work, softening work
    and released energy.
    """
    history = p.slip, p.dilatant_opening, p.cracked != 0.0, p.kappa
    slip, dilatant_opening, was_cracked, kappa = history
    sigma, tau, p.slip, p.dilatant_opening, cracked, p.kappa = explicit_update(
        pressed, u_s, history, joint, special, softening
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
    """Damping stress (Pa), proportional to the rate of elastic stress, without tension in a joint that carries none."""
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
def contact_forces(bodies, neighbours, motion, special, softening, per_step, pressed_per_step, search, joint_terms):
    """Compute the forces of all contacts on the bodies (penalty contact with the joint law), and commit their history.

    The force at the end of a step that passes the kink of the law misses or adds part of the impulse. Within half a
    step's movement w of the kink, the law therefore gets the mean closing over that movement, -(w - u)^2 / (4 w)
    rather than min(u, 0): bouncing blocks then conserve their energy far better.
    """
    points, edges, pose, force, strains = bodies.points, bodies.edges, motion.pose, motion.force, motion.strains
    friction_work, released_energy, fracture_work, damping_work = 0.0, 0.0, 0.0, 0.0
    # consecutive points belong to one joint: sum their forces on its two bodies first
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


@rule
def _append_if_near(bodies, i, other, pose, strains, low, high, margin, polygon, edge, gap, count):
    """Append block ``other`` to the neighbour list of point i if it is within the margin; return its length.

    ``low``, ``high``: boxes round the blocks (m); ``polygon``, ``edge``, ``gap``: the list, of ``count`` entries.
    """
    x, y, along_x, along_y = face_frame(bodies.points, i, bodies.edges, pose, strains)
    own_polygon = bodies.edges[bodies.points[i].own_edge].polygon
    if (other == own_polygon) | (high[other, 0] < x - margin) | (low[other, 0] > x + margin):
        return count
    if (high[other, 1] < y - margin) | (low[other, 1] > y + margin):
        return count
    faced, which, others = signed_distances(x, y, along_x, along_y, bodies, other, pose, strains)
    if (faced >= margin) | (others >= margin):
        return count
    if count < polygon.size:
        polygon[count] = other
        edge[count] = which
        gap[count] = faced
    return count + 1


@kernel
def find_neighbours(
    bodies, x_points, pose, strains, low, high, narrow, start, widest, wide, margin, first, polygon, edge, gap
):
    """Fill the neighbour list (Verlet 1967) of all points with blocks nearer than ``margin``; return its length."""
    count = 0
    for i in range(x_points.size):
        first[i] = count
        x = x_points[i]
        begin = np.searchsorted(start, x - margin - widest)  # narrow blocks are sorted by their left ends
        for s in range(begin, narrow.size):
            if start[s] > x + margin:
                break
            count = _append_if_near(bodies, i, narrow[s], pose, strains, low, high, margin, polygon, edge, gap, count)
        for w in range(wide.size):
            count = _append_if_near(bodies, i, wide[w], pose, strains, low, high, margin, polygon, edge, gap, count)
    first[x_points.size] = count
    return count
