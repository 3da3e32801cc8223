"""Equilibrium of a wall at given loads: residual, linearisation, and the iterations that find it."""
