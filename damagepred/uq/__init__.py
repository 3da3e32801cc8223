"""Uncertainty: distributions, correlation, fields along joints, samplers, fragility, sensitivity.

- ``variable``: the description of one uncertain number in a study file; ``columns``: measured values from a file
- ``families``: which parameters each distribution takes; ``marginals``: tables of values and mixtures
- ``correlation``: Nataf: the correlation of normals that gives variables theirs
- ``fields``: values along a course, each depending on the one before; ``wall_fields``: by the distance of joints
- ``design``: all of it together: every input of every sample
- ``capacity``: the movement at which a category is reached, the one definition of it; ``intensity``: its measures
- ``fragility``: curves and surfaces, their bands and how well they fit; ``exceedance``: one probability, one median
- ``sensitivity``: Sobol's indices; ``given_data``: rank correlation and first-order shares from any study
- ``ranks``: of numbers and of interval-censored capacities
"""
