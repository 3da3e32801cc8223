"""Change of the width of windows and doors."""

from __future__ import annotations

import numpy as np
import xarray as xr
from matplotlib.axes import Axes

from damagepred.errors import InputError
from damagepred.inputs.arguments import checked
from damagepred.plotting.colours import OPENING_STYLES
from damagepred.plotting.sheet import MM, axes_or_new, require, say_nothing_to_draw, set_title, small, title_of

AGAINST = {
    "central_deflection": "central deflection (mm)",
    "load_displacement": "load displacement (mm)",
    "dpc_opening_max": "widest opening of the dpc (mm)",
}
"""What the change can be drawn against."""


@checked
def draw_opening_width_change(ds: xr.Dataset, ax: Axes | None = None, against: str | None = None) -> Axes:
    """Draw how much wider (positive) or narrower each opening has become, at the upper end of its jambs.

    Parameters
    ----------
    ds : xarray.Dataset
        Of one wall, as ``damagepred.solve`` returns it.
    ax : Axes, optional
        Where to draw; by default on a new figure.
    against : {"central_deflection", "load_displacement", "dpc_opening_max"}, optional
        What to draw it against. None: the displacement of the loads in a laboratory test, else the central deflection.

    Raises
    ------
    InputError
        If the dataset is not of one wall, or ``against`` is something else.

    Examples
    --------
    >>> import damagepred, xarray
    >>> ax = damagepred.plotting.draw_opening_width_change(xarray.open_dataset("wall.nc"))
    >>> ax.get_xlabel()
    'central deflection (mm)'
    """
    against = against or ("load_displacement" if "load_displacement" in ds.variables else "central_deflection")
    if against not in AGAINST:
        raise InputError(f"against = '{against}': must be one of {', '.join(AGAINST)}.")
    require(ds, ("block_x", against), "the result of one wall (`damagepred solve`)")
    ax = axes_or_new(ax, 8.0, 5.0)
    ax.set_xlabel(AGAINST[against])
    ax.set_ylabel("change of width at the\nupper end of the jambs (mm)")
    set_title(ax, title_of(ds, "wall"), "openings: widening is positive")
    if not ds.sizes.get("opening", 0):
        say_nothing_to_draw(ax, "no openings: this wall has neither windows nor doors")
        return ax
    x, change = ds[against].values * MM, ds["opening_width_change"].values * MM
    ax.axhline(0.0, color="black", linewidth=0.8)
    for number in range(ds.sizes["opening"]):
        colour, marker = OPENING_STYLES[number % len(OPENING_STYLES)]
        measured = bool(np.isfinite(change[:, number]).any())
        label = _label(ds, number) + ("" if measured else ": has one jamb only")
        ax.plot(x, change[:, number], color=colour, marker=marker, markersize=4, linewidth=1.4, label=label)
    ax.grid(color="0.9")
    ax.set_axisbelow(True)
    ax.legend(fontsize=small(ax))
    return ax


def _label(ds: xr.Dataset, number: int) -> str:
    values = [float(ds[f"opening_{name}"].values[number]) for name in ("left", "sill", "width", "height")]
    if not np.isfinite(values).all():
        return f"opening {number + 1}"
    left, sill, width, height = values
    kind = "window" if sill > 0 else "door"
    return f"{kind} {number + 1}: {width:.2f} x {height:.2f} m, at {left:.2f} m"
