"""Forces between bodies that move as far as they like: points on the faces of blocks against the edges of others.

A boundary point is a material point on the face of a block with the area it stands for. It is measured in the frame of
the edge it faces: how far it is from the edge's line is the opening u_n, its way along the edge the shear u_s. With
tension positive the joint law gives sigma and tau from them; the force sigma A along that edge's normal and tau A along
the edge acts at the point's present place on the one body, and the opposite one, at the same place, on the other. So
momentum and angular momentum are kept exactly, and while the joint is elastic the force is the exact gradient of
A (k_n u_n^2 + k_s u_s^2) / 2 with respect to both poses: whatever turns with both of them costs nothing.

What faces what in the end is one of three things:

- HOME: the edge the point was joined to at first, by mortar or by lying on it. It stays so while the bond holds, and
  after that until it has parted by ``release`` or passed the end of the edge.
- TOUCH: an edge met later. A point that comes into a convex block is in contact with the edge it is least deep behind,
  of those its face looks at. That depth d begins with nothing, and so does the potential k A d^2 / 2: no rounding of
  corners is needed. Once met, the edge is kept until the point parts from it or passes its end by ``reach``; then the
  block, or its neighbour, is asked again, and pressure and friction are carried over where the new edge goes on nearly
  in the direction of the old one. So a block slides over the joints of a course unhindered.
- FREE: nothing.

A point faces one thing at a time, and only what its own face looks at: a corner has two points, one for each of the
faces that meet in it, and the one whose face lies across what is hit has no part in it. Energy is never created by a
change of edge: a point that is found behind an edge through which it did not come counts from there (``offset``), and
what it held is lost where it passes an end with nothing beyond.
"""

import numpy as np

from damagepred.kernels.jit import law, rule
from damagepred.kernels.joint.explicit_update import explicit_update
from damagepred.kernels.joint.limits import coulomb_limit
from damagepred.kernels.joint.parameters import JointParameters

FREE, BONDED, TOUCHING = 0, 1, 2
"""What a point may face."""
FACING = 0.1
"""Cosine between a point's own face and the face met, from which they look at each other: about 84 degrees."""
GOES_ON = 0.7
"""Cosine between two edges from which friction is carried over from one to the other."""
FRICTION, RELEASED, FRACTURE, DASHPOT, JOINT_TERMS = 0, 1, 2, 3, 4
"""What is counted while points act (J): work of friction, energy set free, work of softening, of stiffness damping."""

POINT = np.dtype(
    [
        ("body", "i8"),
        ("own_edge", "i8"),
        ("x", "f8"),
        ("y", "f8"),
        ("area", "f8"),
        ("reach", "f8"),
        ("release", "f8"),
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
whether what is near it has been looked at; memory of the law; opening, shear (m), stresses, and damping stresses (Pa)
of the last cycle."""

EDGE = np.dtype(
    [
        ("body", "i8"),
        ("polygon", "i8"),
        ("face", "i8"),
        ("x", "f8"),
        ("y", "f8"),
        ("along_x", "f8"),
        ("along_y", "f8"),
        ("low", "f8"),
        ("length", "f8"),
    ]
)
"""An edge of a block: its body, block and face; edges that follow each other round a deformable block and were in line
at first make up one face. In that body's frame the end from which the way along it counts (m), and its direction,
clockwise round the block: the outward normal is (-along_y, along_x). Then where it ends on the way, low and length (m):
0 and its length, but for the ground, which goes on to either side."""

LAW = len(JointParameters._fields)
"""Columns of the laws: the fields of ``JointParameters``. A bond's row is followed by one without bond, for contacts
made later."""
SHEAR_COMPLIANCE = JointParameters._fields.index("shear_compliance")
INTACT = JointParameters._fields.index("tensile_strength")
"""Column of f_t; C and tan(phi) follow."""
RESIDUAL = JointParameters._fields.index("residual_tensile_strength")
"""Column of the residual f_t; C and tan(phi) follow."""
CRITICAL_OPENING = JointParameters._fields.index("critical_opening")


@law
def parameters_of(row):
    """Return a row of the laws as ``JointParameters``."""
    return JointParameters(
        row[0],
        row[1],
        row[2],
        row[3],
        row[4],
        row[5],
        row[6],
        row[7],
        row[8],
        row[9],
        row[10],
        row[11],
        row[12],
        row[13],
        row[14],
        row[15],
        row[16],
        row[17],
        row[18],
        row[19],
    )


@law
def edge_coordinates(points, i, edges, e, pose):
    """Return the coordinates of point i in the frame of edge e.

    Parameters
    ----------
    points, edges : array of record
        ``POINT``, ``EDGE``.
    i, e : int
        Point and edge.
    pose : array (bodies, 4)
        x, y (m), cosine and sine of the rotation of each body.

    Returns
    -------
    tuple of float
        Lever arms x, y from the centroids of the point's body and of the edge's (m); coordinate along the edge and
        signed distance from its line, outside positive (m); direction of the edge.
    """
    a, b = points[i].body, edges[e].body
    x, y, ca, sa = points[i].x, points[i].y, pose[a, 2], pose[a, 3]
    arm_ax, arm_ay = ca * x - sa * y, sa * x + ca * y
    at_x, at_y = pose[a, 0] + arm_ax, pose[a, 1] + arm_ay
    arm_bx, arm_by = at_x - pose[b, 0], at_y - pose[b, 1]
    cb, sb = pose[b, 2], pose[b, 3]
    local_x, local_y = cb * arm_bx + sb * arm_by - edges[e].x, cb * arm_by - sb * arm_bx - edges[e].y
    t_x, t_y = edges[e].along_x, edges[e].along_y
    along = t_x * local_x + t_y * local_y
    gap = t_x * local_y - t_y * local_x
    return arm_ax, arm_ay, arm_bx, arm_by, along, gap, cb * t_x - sb * t_y, sb * t_x + cb * t_y


@rule
def signed_distances(at_x, at_y, own_x, own_y, edges, first, last, pose):
    """Return the signed distances of a place on a face from the edges of one block, convex or slightly bent.

    Parameters
    ----------
    at_x, at_y : float
        The place (m).
    own_x, own_y : float
        Direction of the face it lies on, a unit vector.
    edges : array of record (e,)
        ``EDGE``.
    first, last : int
        Edges of the block: from the first to before the last.
    pose : array (bodies, 4)
        x, y (m), cosine and sine of the rotation of each body.

    Returns
    -------
    faced : float
        Largest signed distance from the edges that the face looks at (m); inside it is minus the least depth.
    which : int
        The edge it belongs to, -1 if the face looks at none.
    others : float
        Largest signed distance from the other edges (m).
    """
    faced, others, which = -np.inf, -np.inf, -1
    nearest, distance, at, looks = np.inf, 0.0, -1, 0.0
    for e in range(first, last):
        b = edges[e].body
        arm_x, arm_y = at_x - pose[b, 0], at_y - pose[b, 1]
        cb, sb = pose[b, 2], pose[b, 3]
        local_x, local_y = cb * arm_x + sb * arm_y - edges[e].x, cb * arm_y - sb * arm_x - edges[e].y
        t_x, t_y = edges[e].along_x, edges[e].along_y
        # of a face of several edges, which need not be convex when it is bent, the one that the place is beside
        along = t_x * local_x + t_y * local_y
        past = max(-along, along - edges[e].length)
        if past < nearest:
            nearest, at = past, e
            distance = t_x * local_y - t_y * local_x
            looks = (cb * t_x - sb * t_y) * own_x + (sb * t_x + cb * t_y) * own_y
        if e + 1 < last and edges[e + 1].face == edges[e].face:
            continue
        if looks < -FACING:
            if distance > faced:
                faced, which = distance, at
        elif distance > others:
            others = distance
        nearest = np.inf
    return faced, which, others


@law
def face_frame(points, i, edges, pose):
    """Return the position x, y of point i (m), and the direction of its face, a unit vector.

    Parameters
    ----------
    points, edges : array of record
        ``POINT``, ``EDGE``.
    i : int
        The point.
    pose : array (bodies, 4)
        x, y (m), cosine and sine of the rotation of each body.
    """
    a, own = points[i].body, points[i].own_edge
    ca, sa = pose[a, 2], pose[a, 3]
    x, y, t_x, t_y = points[i].x, points[i].y, edges[own].along_x, edges[own].along_y
    return pose[a, 0] + ca * x - sa * y, pose[a, 1] + sa * x + ca * y, ca * t_x - sa * t_y, sa * t_x + ca * t_y


@rule
def detect_contact(points, i, edges, first_edge, neighbours, pose, laws, pressed, sheared, old_x, old_y):
    """Detect contact of a free point with a neighbouring block, and start it; return whether there is one.

    The point touches the edge of least penetration (node-to-segment contact, Wriggers 2006).

    Parameters
    ----------
    points, edges, first_edge, neighbours, pose, laws
        See ``contact_forces``.
    i : int
        The point.
    pressed, sheared : float
        Opening (not positive, m) and shear stress (Pa) at the edge that it left just now; 0 if it left none.
    old_x, old_y : float
        Direction of that edge.
    """
    p = points[i]
    at_x, at_y, own_x, own_y = face_frame(points, i, edges, pose)
    found, deepest, came_from = -1, np.inf, 0.0
    for k in range(neighbours.first[i], neighbours.first[i + 1]):
        polygon = neighbours.polygon[k]
        gap, e, others = signed_distances(
            at_x, at_y, own_x, own_y, edges, first_edge[polygon], first_edge[polygon + 1], pose
        )
        before = neighbours.distance[k] if (p.searched != 0) & (neighbours.edge[k] == e) else min(gap, 0.0)
        neighbours.distance[k] = gap
        neighbours.edge[k] = e
        # half the way of a step ahead: what is met within it presses already, see ``contact_forces``
        if (e < 0) | (gap >= 0.5 * abs(gap - before)) | (gap >= deepest):
            continue
        # through the face itself, or it was behind its line already and came from the side, and is inside by now
        if (before > 0.0) & (others < p.reach) | (others < gap):
            found, deepest, came_from = e, gap, before
    p.searched = 1
    if found < 0:
        return False
    _, _, _, _, along, gap, t_x, t_y = edge_coordinates(points, i, edges, found, pose)
    number = p.law | 1
    is_mechanism = pressed < 0.0 and t_x * old_x + t_y * old_y > GOES_ON
    p.law = number
    p.target = found
    p.status = TOUCHING
    p.searched = 0
    p.offset = 0.0 if came_from > 0.0 else max(-gap + (pressed if is_mechanism else 0.0), 0.0)
    p.anchor = along - (sheared * laws[number, SHEAR_COMPLIANCE] if is_mechanism else 0.0)
    p.slip = 0.0
    p.dilatant_opening = 0.0
    p.kappa = 0.0
    p.cracked = 1.0
    p.opening = came_from if came_from > 0.0 else gap + p.offset
    p.shear = along - p.anchor
    p.sigma = laws[number, 0] * pressed if is_mechanism else 0.0
    p.tau = sheared if is_mechanism else 0.0
    p.damping_n = 0.0
    p.damping_s = 0.0
    return True


@law
def stored_energy(sigma, tau, opening, compliance, shear_compliance, softened):
    """Return the elastic energy of a contact per area (J/m2).

    Parameters
    ----------
    sigma, tau : float
        Normal stress, tension positive, and shear stress (Pa).
    opening : float
        Normal opening without its dilatant part (m).
    compliance, shear_compliance : float
        1 / k_n, 1 / k_s (m/Pa).
    softened : bool
        Whether the normal part unloads along the secant: sigma opening / 2 in place of sigma^2 / (2 k_n).
    """
    normal = sigma * opening if softened else sigma * sigma * compliance
    return 0.5 * (normal + tau * tau * shear_compliance)


@rule
def release_contact(points, i, edges, first_edge, neighbours, pose, laws, joint_terms, along, gap, t_x, t_y, search):
    """Release a point that passed the end of its edge, and detect its next contact; return whether there is one.

    The elastic energy that the next contact does not take over is counted as released.

    Parameters
    ----------
    points, edges, first_edge, neighbours, pose, laws, joint_terms
        See ``contact_forces``.
    i : int
        The point.
    along, gap : float
        Coordinate along the edge that it leaves, and signed distance from it, outside positive (m).
    t_x, t_y : float
        Direction of that edge.
    search : bool
        Whether points may touch blocks that they were not bonded to.
    """
    p = points[i]
    number = p.law
    u_n, u_s = gap + p.offset, along - p.anchor
    before = stored_energy(
        p.sigma,
        p.tau,
        p.opening - p.dilatant_opening,
        1.0 / laws[number, 0],
        laws[number, SHEAR_COMPLIANCE],
        False,
    )
    if p.sigma > 0.0:
        before = 0.5 * (p.sigma * (p.opening - p.dilatant_opening) + p.tau * p.tau * laws[number, SHEAR_COMPLIANCE])
    work = 0.5 * (p.sigma * (u_n - p.opening) + p.tau * (u_s - p.shear))
    pressed = min(u_n - p.dilatant_opening, 0.0) if p.sigma < 0.0 else 0.0
    sheared = p.tau
    p.status = FREE
    p.searched = 0
    after = 0.0
    met = search and detect_contact(points, i, edges, first_edge, neighbours, pose, laws, pressed, sheared, t_x, t_y)
    if met:
        after = stored_energy(p.sigma, p.tau, 0.0, 1.0 / laws[p.law, 0], laws[p.law, SHEAR_COMPLIANCE], False)
    else:
        p.law = number | 1
        p.sigma = 0.0
        p.tau = 0.0
        p.damping_n = 0.0
        p.damping_s = 0.0
    joint_terms[RELEASED] += p.area * (before + work - after)
    return met


@law
def add_force_pair(force, a, b, x, y, moment_a, moment_b):
    """Add a force to body a, the opposite force to body b, and the moments of both.

    Parameters
    ----------
    force : array (bodies, 3)
        Force x, y (N) and moment (N m) on each body: added to.
    a, b : int
        The bodies.
    x, y : float
        Force on body a (N).
    moment_a, moment_b : float
        Moment on each about its reference point, counter-clockwise (N m).
    """
    force[a, 0] += x
    force[a, 1] += y
    force[a, 2] += moment_a
    force[b, 0] -= x
    force[b, 1] -= y
    force[b, 2] += moment_b


@rule
def contact_forces(
    points,
    edges,
    first_edge,
    neighbours,
    laws,
    pose,
    force,
    special,
    softening,
    per_step,
    pressed_per_step,
    search,
    joint_terms,
):
    """Compute the forces of all contacts on the bodies (penalty contact with the joint law), and commit their history.

    A point that is pressed in one step and not in the next passes the kink of the law somewhere in between. A force
    taken at the end of the step misses part of the impulse, or adds to it, at random. So where the point is nearer to
    the kink than half its way in the last step, the law is given the mean pressure over a step's way about here:
    -(w - u)^2 / (4 w) in place of min(u, 0), with w half that way. What bounces then keeps its energy far better.

    Parameters
    ----------
    points : array of record (p,)
        ``POINT``.
    edges : array of record (e,)
        ``EDGE``, block by block, counter-clockwise round each.
    first_edge : array of int (polygons + 1,)
        Where those of each block begin.
    neighbours : NamedTuple of arrays
        ``first`` (p + 1,), ``polygon``, ``edge`` and ``distance`` (k,): blocks near each point, and how far the edge
        that its face looks at was last.
    laws : array (l, LAW)
        See ``LAW``.
    pose : array (bodies, 4)
        x, y (m), cosine and sine of the angle of each body.
    force : array (bodies, 3)
        Force x, y (N) and moment (N m) on each body: added to.
    special : bool or None
        None if no joint dilates, breaks or wears by slip or has a cap: what they need is then left out when compiling.
    softening : bool or None
        None if no bond softens.
    per_step : float
        Stiffness-proportional damping over the time step (1).
    pressed_per_step : float
        The same of contacts without tensile strength, in addition.
    search : bool
        Whether points may meet what they did not face at first.
    joint_terms : array (JOINT_TERMS,)
        Added to.
    """
    rubbed, freed, torn, dashed = 0.0, 0.0, 0.0, 0.0
    # points of one joint follow each other: what they do to its two bodies is summed up before it is handed on
    last_a, last_b = 0, 0
    a_x, a_y, a_m, b_m = 0.0, 0.0, 0.0, 0.0
    for i in range(points.size):
        p = points[i]
        if p.status == FREE:
            if not search or neighbours.first[i] == neighbours.first[i + 1]:
                continue
            if not detect_contact(points, i, edges, first_edge, neighbours, pose, laws, 0.0, 0.0, 0.0, 0.0):
                continue
        ax, ay, bx, by, along, gap, t_x, t_y = edge_coordinates(points, i, edges, p.target, pose)
        if (along < edges[p.target].low - p.reach) | (along > edges[p.target].length + p.reach):
            if not release_contact(
                points, i, edges, first_edge, neighbours, pose, laws, joint_terms, along, gap, t_x, t_y, search
            ):
                continue
            ax, ay, bx, by, along, gap, t_x, t_y = edge_coordinates(points, i, edges, p.target, pose)
        u_n, u_s = gap + p.offset, along - p.anchor
        moved = u_n - p.opening

        row = p.law
        k_n, k_s = laws[row, 0], laws[row, 1]
        was_cracked, dilatant_opening, slip, was_opened = p.cracked != 0.0, p.dilatant_opening, p.slip, p.kappa
        away, half = u_n - dilatant_opening, 0.5 * abs(moved)
        # most contacts neither give way nor pass the kink: then there is no more to the law than this
        sigma, tau = k_n * away, k_s * (u_s - slip)
        column = RESIDUAL if was_cracked else INTACT
        no_tension = was_cracked & (laws[row, RESIDUAL] == 0.0)
        limit = coulomb_limit(laws[row, column + 1], laws[row, column + 2], sigma)
        gives = (sigma > laws[row, column]) | (abs(tau) > limit)
        gives = gives | (no_tension & (abs(away) < half))
        if softening is not None:
            gives = gives | (was_cracked & (laws[row, CRITICAL_OPENING] > 0.0))
            no_tension = no_tension & (p.kappa >= laws[row, CRITICAL_OPENING])
        cracked, brittle_shear = was_cracked, False
        if special is not None:
            parameters = parameters_of(laws[row])
            brittle_shear = parameters.brittle_shear != 0.0
            gives = gives | (parameters.compressive_strength < np.inf)
        if gives:
            # the law, past the kink by its mean
            pressed = u_n
            if no_tension & (abs(away) < half):
                pressed = dilatant_opening - (half - away) * (half - away) / (4.0 * half)
            sigma, tau, new_slip, new_dilated, cracked, kappa = explicit_update(
                pressed, u_s, slip, dilatant_opening, was_cracked, p.kappa, parameters_of(laws[row]), special, softening
            )
            p.slip = new_slip
            p.dilatant_opening = new_dilated
            p.cracked = 1.0 if cracked else 0.0
            p.kappa = kappa

            # where the work went
            mean_sigma, mean_tau = 0.5 * (sigma + p.sigma), 0.5 * (tau + p.tau)
            rubbed += p.area * (mean_tau * (new_slip - slip) + mean_sigma * (new_dilated - dilatant_opening))
            softens, snaps = False, False
            if softening is not None:
                w_c = laws[row, CRITICAL_OPENING]
                softens = cracked & (w_c > 0.0) & ((p.sigma > 0.0) | (sigma > 0.0))
                # slip that breaks the bond sets free what it holds
                snaps = softens & brittle_shear & (was_opened < w_c) & (kappa >= w_c) & (u_n - new_dilated < w_c)
            if (cracked != was_cracked) | softens:
                lost = mean_sigma * (moved - new_dilated + dilatant_opening) + 0.5 * p.sigma * (
                    p.opening - dilatant_opening
                )
                lost -= 0.5 * sigma * (u_n - new_dilated)
                if softens & (not snaps):
                    torn += p.area * lost
                else:
                    freed += p.area * lost

        # damping by the rate of the elastic stress; it never pulls a joint that carries no tension
        pull_n, pull_s = sigma, tau
        rate = per_step + (pressed_per_step if no_tension else 0.0)
        if rate > 0.0:
            damping_n, damping_s = rate * (sigma - p.sigma), rate * (tau - p.tau)
            if cracked != was_cracked or (no_tension and sigma == 0.0):
                damping_n, damping_s = 0.0, 0.0
            elif cracked and sigma <= 0.0 and sigma + damping_n > 0.0:
                damping_n = -sigma
            moved_s = u_s - p.shear
            dashed += 0.5 * p.area * ((damping_n + p.damping_n) * moved + (damping_s + p.damping_s) * moved_s)
            p.damping_n = damping_n
            p.damping_s = damping_s
            pull_n += damping_n
            pull_s += damping_s

        p.opening = u_n
        p.shear = u_s
        p.sigma = sigma
        p.tau = tau
        if sigma == 0.0 and tau == 0.0:
            if cracked and away > (p.release if p.status == BONDED else half):
                p.status = FREE
                p.searched = 0
                p.law = p.law | 1
            continue
        a, b = p.body, edges[p.target].body
        pull_n *= p.area
        pull_s *= p.area
        f_x, f_y = pull_n * t_y - pull_s * t_x, -pull_n * t_x - pull_s * t_y
        if (a != last_a) | (b != last_b):
            add_force_pair(force, last_a, last_b, a_x, a_y, a_m, b_m)
            last_a, last_b = a, b
            a_x, a_y, a_m, b_m = 0.0, 0.0, 0.0, 0.0
        a_x += f_x
        a_y += f_y
        a_m += ax * f_y - ay * f_x
        b_m -= bx * f_y - by * f_x
    add_force_pair(force, last_a, last_b, a_x, a_y, a_m, b_m)
    joint_terms[FRICTION] += rubbed
    joint_terms[RELEASED] += freed
    joint_terms[FRACTURE] += torn
    joint_terms[DASHPOT] += dashed
