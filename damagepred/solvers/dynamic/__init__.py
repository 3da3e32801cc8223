"""Physical mass and time, geometry updated: blocks rock, slide, fall, meet others and come to rest.

``scenery`` tells what bodies look like to each other, ``motion`` where they are, ``sides`` what deformable blocks show
of themselves, ``grid`` where their gridpoints are and what their zones do, ``step`` how far all may go at a time,
``base`` what shakes them, ``near`` whom they may meet, ``beginning`` where they start, ``audit`` where the energy goes;
``run`` puts these together. The laws are in ``damagepred.kernels.large_contact``, ``large_motion`` and ``large_zones``.
"""

from damagepred.solvers.dynamic.run import DynamicRun

__all__ = ["DynamicRun"]
