"""Jacks on one pump: what the pump has delivered and what the jacks have taken up make their common load."""

from damagepred.kernels.jit import law

VOLUME, LOAD = 0, 1


@law
def press(pump, displacement, load_factor, load_factor_step, force):
    """Add the forces of the jacks, which follow the pump, which follows the deflection.

    The pump's line is a spring, load = stiffness * (volume - lift): its forces have an energy, whatever the deflection
    is measured on, and so cannot stir up a swing. Only the volume is controlled, slowly.

    Parameters
    ----------
    pump : NamedTuple
        See ``damagepred.solvers.explicit.jack_servo.PumpLine``; its ``state`` is brought up to date.
    displacement, force : array (size,)
        Of all degrees of freedom.
    load_factor, load_factor_step : float
        Share of the full movement reached, and its change in this cycle.
    """
    lift, deflection = 0.0, 0.0
    for i in range(pump.dof.size):
        u = displacement[pump.dof[i]]
        lift += pump.push[i] * u
        deflection += pump.weight[i] * u
    missing = pump.origin + load_factor * pump.goal - deflection
    volume = pump.state[VOLUME] + load_factor_step * pump.volume_step + pump.gain * missing
    load = pump.load + load_factor * pump.load_step + pump.stiffness * (volume - lift)
    pump.state[VOLUME] = volume
    pump.state[LOAD] = load
    for i in range(pump.dof.size):
        force[pump.dof[i]] += load * pump.push[i]
