"""What is free while the dead load comes on, and held from then on where it stands."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from damagepred.assembly import Model

FloatArray = NDArray[np.float64]


def while_loading(model: Model) -> Model:
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


def held_after_load(model: Model, displacement: FloatArray) -> Model:
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
