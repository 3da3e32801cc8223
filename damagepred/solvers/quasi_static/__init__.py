"""The path of equilibria itself: no time, no damping, no loading rate.

``equations`` solve the linear wall, ``equilibrium`` finds one equilibrium, ``path`` goes from one to the next and
breaks bonds, ``relaxation`` lets the wall move by itself where none is near, ``work`` tells where the energy goes.
"""

from damagepred.solvers.quasi_static.continuation import quasi_static_path

__all__ = ["quasi_static_path"]
