"""Newton's law for all degrees of freedom, with Cundall's local damping (paper, Eq. 7)."""

from damagepred.kernels.jit import law


@law
def move(force, inverse_mass, damping, velocity, displacement):
    """Advance velocity and displacement by one time step of length 1.

    Parameters
    ----------
    force, inverse_mass, velocity, displacement : array (3 (blocks + 1),)
        Unbalanced force and state of each degree of freedom; inverse mass 0 holds it.
    damping : float
        Local damping: this share of the unbalanced force's size opposes the velocity.
    """
    for j in range(force.size):
        drag = damping * abs(force[j])
        if velocity[j] > 0.0:
            push = force[j] - drag
        elif velocity[j] < 0.0:
            push = force[j] + drag
        else:
            push = force[j]
        velocity[j] += push * inverse_mass[j]
        displacement[j] += velocity[j]
