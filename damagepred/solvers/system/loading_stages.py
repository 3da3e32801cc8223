"""Supports and properties by loading stage: while the dead load is applied, in the level state, and after it."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.enumerations import ContactKind


def supported_during_load(model: Model) -> Model:
    """Model without the deferred supports and jacks, which act only after the dead load."""
    if model.jacks is not None and model.jacks.after_load:
        model = replace(model, jacks=None)
    supports = model.supports
    if not supports.after_load.any():
        return model
    held = ~supports.after_load
    return replace(
        model,
        supports=supports._replace(
            prescribed=supports.prescribed[held],
            prescribed_displacement=supports.prescribed_displacement[held],
            start=supports.start[held],
            after_load=supports.after_load[held],
        ),
    )


def unilateral_supports(model: Model) -> IntArray:
    """Interfaces of unilateral supports under a footing on jacks."""
    if model.jacks is None or model.jacks.after_load:
        return np.empty(0, dtype=np.int64)
    return np.flatnonzero((model.interfaces.kind == ContactKind.SUPPORT) & (model.properties.tensile_strength == 0.0))


def level(model: Model) -> Model:
    """Model with bilateral supports under a footing on jacks, for the level state."""
    # walls are built on a level footing; under proportional dead load intact bonds would lift it off its supports
    law, held = model.properties, unilateral_supports(model)
    if not held.size:
        return model
    tension, cohesion = law.tensile_strength.copy(), law.cohesion.copy()
    tension[held] = cohesion[held] = np.inf
    return replace(model, properties=law._replace(tensile_strength=tension, cohesion=cohesion))


def activate_deferred_supports(model: Model, displacement: FloatArray) -> Model:
    """Model with deferred supports and jacks, whose prescribed displacements count from the dead-load displacement."""
    supports = model.supports
    start = np.where(supports.after_load, displacement[supports.prescribed], supports.start)
    none, jacks = np.zeros_like(supports.after_load), model.jacks
    if jacks is not None and jacks.after_load:
        jacks = jacks._replace(origin=float(jacks.weights @ displacement))
    return replace(model, jacks=jacks, supports=supports._replace(start=start, after_load=none))
