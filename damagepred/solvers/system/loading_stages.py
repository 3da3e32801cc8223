"""What is free while the dead load comes on and held from then on, and what is held until then."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from damagepred.arrays import FloatArray, IntArray
from damagepred.assembly import Model
from damagepred.enumerations import ContactKind


def supported_during_load(model: Model) -> Model:
    """Return the model as it is while the dead load comes on: nothing is held yet that is only held after it.

    Parameters
    ----------
    model : Model
        The wall.
    """
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
    """Return the interfaces of supports under a footing on jacks that push only.

    Parameters
    ----------
    model : Model
        The wall.
    """
    if model.jacks is None:
        return np.empty(0, dtype=np.int64)
    return np.flatnonzero((model.interfaces.kind == ContactKind.SUPPORT) & (model.properties.tensile_strength == 0.0))


def level(model: Model) -> Model:
    """Return the model with a footing on jacks that its supports hold down as well while the dead load comes on.

    A wall is built on a level footing. Its load comes on in proportion here, which is how the level state is computed:
    a wall whose bonds do not yet break spans the footing, and would lift it off supports that only push.

    Parameters
    ----------
    model : Model
        The wall.
    """
    law, held = model.properties, unilateral_supports(model)
    if not held.size:
        return model
    tension, cohesion = law.tensile_strength.copy(), law.cohesion.copy()
    tension[held] = cohesion[held] = np.inf
    return replace(model, properties=law._replace(tensile_strength=tension, cohesion=cohesion))


def supported_after_load(model: Model, displacement: FloatArray) -> Model:
    """Return the model as it is once the dead load is on: all is held, from where it stands.

    Parameters
    ----------
    model : Model
        The wall.
    displacement : array (3 (n + 1),)
        Of the blocks and the ground, under the dead load.
    """
    supports = model.supports
    start = np.where(supports.after_load, displacement[supports.prescribed], supports.start)
    none = np.zeros_like(supports.after_load)
    return replace(model, supports=supports._replace(start=start, after_load=none))
