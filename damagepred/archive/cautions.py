"""Cautions on how walls were solved: energy error, snap-through, brittle bonds, widths that depend on rounding."""

from __future__ import annotations

import tomllib
from collections.abc import Mapping
from typing import Any

import numpy as np
import xarray as xr

from damagepred.arrays import FloatArray
from damagepred.diagnostics import Energies, described
from damagepred.enumerations import MASONRY, ContactState

STUDIED = ("energy_error_share", "snap_through_share", "displacement_share", "crack_share", "snap_back_limited")
"""Results of a study that ``study_cautions`` reads."""


def work_done(values: Mapping[Any, Any]) -> FloatArray:
    """Largest term of the energy balance at each increment (J)."""
    work = np.zeros(np.shape(values["energy_error"]))
    for name, energy in described(Energies).items():
        if energy.term and name in values:
            work = np.fmax(work, np.abs(np.asarray(values[name], dtype=np.float64)))
    return work


def energy_shares(values: Mapping[Any, Any]) -> dict[str, float]:
    """Largest energy error, and energy set free in snap-through, over the largest work done; NaN if not counted."""
    most, shares = float(work_done(values).max(initial=0.0)), {}
    for share, name in (("energy_error_share", "energy_error"), ("snap_through_share", "snap_through_energy")):
        energy = np.abs(np.asarray(values.get(name, np.nan), dtype=np.float64))
        energy = energy[np.isfinite(energy)]
        shares[share] = float(energy.max() / most) if energy.size and most > 0.0 else float("nan")
    return shares


TOLERANCES = {
    "energy_error_share": "energy_tolerance",
    "displacement_share": "displacement_tolerance",
    "crack_share": "crack_tolerance",
}
"""Shares that make a wall implausible, and the solver settings with their limits."""


def implausible(shares: Mapping[str, float], settings: Any) -> bool:
    """Whether one of the shares of a wall exceeds its tolerance."""
    return any(shares.get(share, np.nan) > getattr(settings, option) for share, option in TOLERANCES.items())


_SNAP_THROUGH = (
    "no equilibrium was near, and the wall moved by itself to another, one of several. Positions of bricks and widths "
    "of cracks depend on the number of increments there. Solve with another number and compare."
)
_TOO_LARGE = (
    "the equations take displacements as small, so the result is implausible. Check stiffness, density, loads and "
    "their units."
)
_TOO_LONG, _WORK, _SIZE = "the steps are too long. Take more increments.", "largest work done", "wall's size"
_MOVED = "the largest displacement beyond the ground's is"
_CAUTIONS = (
    ("energy_error_share", "energy_tolerance", "energy that does not balance is", _WORK, _TOO_LONG),
    ("snap_through_share", "snap_through_tolerance", "energy set free in snap-through is", _WORK, _SNAP_THROUGH),
    ("displacement_share", "displacement_tolerance", _MOVED, _SIZE, _TOO_LARGE),
    ("crack_share", "crack_tolerance", "the widest crack is", _SIZE, _TOO_LARGE),
)
"""Share, tolerance, and parts of the sentence above the tolerance: quantity, reference, consequence."""


def wall_cautions(ds: xr.Dataset) -> list[str]:
    """Sentences on how a wall was solved; empty for archives of older versions."""
    sentences = []
    for name, option, what, whole, consequence in _CAUTIONS:
        share, limit = (float(ds.attrs.get(key, np.nan)) for key in (name, option))
        if share > limit:
            above = f"{share:.2g} of the {whole}, more than {option} = {limit:g}"
            sentences.append(f"{what[0].upper()}{what[1:]} {above}: {consequence}")
    if count := int(ds.attrs.get("snap_back_limited_joints", 0)):
        sentences.append(f"In {count} joints the bond breaks at once: {_SNAP_BACK}")
    if "loading_not_run" in ds.attrs:
        sentences.append(
            f"The run ends before the motion of base or ground: the motion {ds.attrs['loading_not_run']} is not run. "
            "Give [dynamics] a longer duration, or leave it out."
        )
    if "contact_state" in ds:
        in_wall = np.isin(ds["contact_kind"].values, MASONRY)
        cracked = (ds["contact_state"].values == ContactState.CRACKED).any(axis=0) & in_wall
        reasons = [_RINGING] if ds.attrs.get("solver_method") == "explicit" else []
        progress = ds["progress"].values if "progress" in ds else np.zeros(1)
        side = np.sign(progress[np.isfinite(progress)])
        passes = int(((side[:-1] != 0.0) & (side[1:] != side[:-1])).sum())  # returns to zero and changes of sign
        if passes >= PASSES_DETERMINED:
            reasons.append(_HISTORY.format(passes))
        joint = tomllib.loads(str(ds.attrs.get("scene", ""))).get("joint", {})
        if "contact_cohesion" in ds and "fracture_energy" not in joint:
            strength = np.fmin(ds["contact_tensile_strength"].values, ds["contact_cohesion"].values)
            if (cracked & (strength > 0.0) & (strength < SMALL_BOND)).any():
                reasons.append(_SMALL_BONDS)
        if count := int(cracked.sum()):
            sentences += [f"In {count} contacts of bed and head joints the wall has cracked: {why}" for why in reasons]
    return sentences


PASSES_DETERMINED = 3  # passes of zero from which histories of cracked walls are undetermined (studies/determined)
_RINGING = (
    "the explicit solver oscillates as bonds break, and rounding may decide which bond breaks next. Single widths may "
    'differ on another processor. Compare with method = "quasi_static", or judge on many samples.'
)
_HISTORY = (
    "the movement passes zero {} times. Each time differences grow where loose bricks slide, and after some passes "
    "rounding may decide single widths. They may differ on another processor: judge on many samples."
)
SMALL_BOND = 10e3
"""Cohesion or tensile strength (Pa) below which brittle bonds leave the equilibrium undetermined."""
_SMALL_BONDS = (
    "bonds of less than 10 kPa break at once. The two solvers may end in different equilibria, each of them stable "
    "under finer steps, with other widths, bands and categories. Solve with both methods, or judge on many samples."
)
_SNAP_BACK = (
    "fracture_energy or shear_fracture_energy is less than the elastic energy of the joint at failure (snap-back). The "
    "other mode softens if its energy suffices; slip without a softening tension leaves the bond as it is."
)


def study_cautions(ds: xr.Dataset) -> list[str]:
    """Sentences on how the walls of a study were solved."""
    sentences = []
    for name, option, what, whole, consequence in _CAUTIONS:
        if name not in ds:
            continue
        share = np.asarray(ds[name].values, dtype=np.float64)
        limit = float(ds[name].attrs.get("tolerance", np.nan))
        if count := int((share > limit).sum()):
            most = f"more than {option} = {limit:g} of the {whole}, {np.nanmax(share):.2g} at most"
            sentences.append(f"In {count} walls {what} {most}: {consequence}")
    if "snap_back_limited" in ds:
        counts = np.maximum(np.nan_to_num(np.asarray(ds["snap_back_limited"].values, dtype=np.float64)), 0.0)
        if counts.any():
            most = f"in {int(counts.max())} joints of a wall at most"
            sentences.append(f"In {int((counts > 0).sum())} walls bonds break at once, {most}: {_SNAP_BACK}")
    return sentences
