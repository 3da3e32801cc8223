"""The path of equilibria itself: no time, no damping, no loading rate.

``linear_system`` solves the linear wall, ``equilibrium`` finds one equilibrium, ``continuation`` goes from one to the
next and breaks bonds, ``dynamic_relaxation`` lets the wall move by itself where none is near, ``energy_balance`` tells
where the energy goes.
"""
