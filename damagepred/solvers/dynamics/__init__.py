"""Physical mass and time, geometry updated: blocks rock, slide, fall, meet others and come to rest.

``body_arrays``: edges, boundary points and laws as kernels take them. ``body_motion``: poses, velocities and forces.
``strains``: elastic blocks. ``base_motion``: pulses and records. ``contact_search``: neighbours.
``time_step``, ``energy_balance``, ``options``, and ``run``, which joins them. The laws are in
``damagepred.kernels.dynamics``.
"""
