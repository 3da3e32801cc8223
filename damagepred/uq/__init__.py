"""Uncertainty: distributions, correlation, fields along joints, samplers, fragility, sensitivity.

- ``variable``: what a study file says of one uncertain number; ``columns``: measured values from a file
- ``families``: which parameters each distribution takes; ``marginals``: tables of values and mixtures
- ``correlation``: Nataf: the correlation of normals that gives variables theirs
- ``fields``: values along a course, each depending on the one before; ``wall_fields``: by the distance of joints
- ``design``: all of it together: every input of every sample
- ``sensitivity``: Sobol's indices
"""
