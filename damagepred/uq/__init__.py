"""Uncertainty: distributions, correlation, fields along joints, samplers, fragility, sensitivity.

- ``variable``: the description of one uncertain number in a study file; ``samplers``: points and tables of samples
- ``random_streams``: random numbers for each sample and purpose
- ``families``: parameters of each distribution; ``marginals``: tables of values and mixtures
- ``correlation``: Nataf's correlation of the normals behind variables; ``fields``: values from joint to joint
- ``design``: every input of every sample, and its density under other distributions; ``importance``: weighted samples
- ``capacity``: the movement at which a category is reached, the one definition of it; ``intensity``: its measures
- ``failure_bounds``: capacities with all failed walls undamaged or damaged
- ``fragility``: curves and surfaces, their bands and how well they fit; ``exceedance``: one probability, one median
- ``sensitivity``: rank correlation and shares of variance from any study
"""
