"""The movement that a probability is asked for: one movement, a site class, a distribution, or each wall's own ground.

Within the limits of a site class, y_s is taken as evenly distributed, an assumption. The probability of damage is the
mean at ``POINTS`` movements of equal probability (midpoint rule on the quantiles).
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from typing import Any

import numpy as np
import xarray as xr

from damagepred.errors import InputError
from damagepred.scene.quantity import is_number, to_si
from damagepred.scene.site import SiteClass, site_classes
from damagepred.uq.intensity import OF_SITE, movement_words
from damagepred.uq.variable import Distribution

MOUND = "surface_movement"

POINTS = 64  # parts of equal probability; a step of a capacity within one of them is an error of less than 1/128


@dataclass(frozen=True)
class MovementDistribution:
    """Movements of equal probability."""

    name: str  # in words, such as "class H1"
    points: tuple[float, ...]  # in ascending order, in SI units
    assumption: str = ""  # assumption, in a sentence; empty for one movement
    measure: str = ""  # measure of the movement that they are values of; empty where the text does not say
    own: bool = False  # whether they are shares of each wall's own movement

    def __post_init__(self) -> None:
        """Refuse movements that are not positive."""
        if not (self.points and all(math.isfinite(point) and point > 0 for point in self.points)):
            raise InputError(f"at = {self.name}: must be greater than 0.")

    def require_measure(self, ds: xr.Dataset, measure: str) -> None:
        """Refuse studies whose measure of the movement differs from the site class's, and ground without one."""
        if self.measure and self.measure == measure and (words := movement_words(ds, measure)) != OF_SITE:
            raise InputError(
                f"at = {self.name}: classes are of the movement y_s of reactive clay, and the {words} has none; "
                'ask for a movement, such as "25 mm".'
            )
        if self.measure and self.measure != measure:
            raise InputError(
                f"at = {self.name}: is of the {self.measure.replace('_', ' ')}, and the study's movement is the "
                f"{measure.replace('_', ' ')}; ask for a movement, or move the ground as a mound."
            )

    @property
    def words(self) -> str:
        """The movement in words."""
        of_class = f"{'site ' * (self.measure == MOUND)}{self.name}"
        return "the end of each wall's own movement" if self.own else of_class

    @property
    def largest(self) -> float:
        """The largest of the movements."""
        return self.points[-1]


SITE = MovementDistribution("site", (1.0,), own=True)


def movement_distribution(text: str, unit: str = "m", option: str = "at") -> MovementDistribution:
    """Read "60 mm", "H1", "site" (for an option at) or a distribution as in a study file; others are refused."""
    if "=" in text:
        return _distributed(text, unit)
    if text.strip().lower() == SITE.name and option.endswith("at"):
        return SITE
    classes = {entry.name: entry for entry in site_classes()}
    if text.strip().upper() in classes:
        return _of_class(classes[text.strip().upper()])
    if unit != "1" and is_number(text):
        raise InputError(f"{option} {text}: give the unit with the number, such as '{text} mm' or '{text} {unit}'.")
    try:
        movement = to_si(text, unit)
    except ValueError as error:
        raise InputError(
            f'{option} "{text}": must be a movement such as "60 mm", a site class ({", ".join(classes)}), "site", or a '
            'distribution such as \'distribution = "lognormal", mean = "45 mm", cov = 0.3\'; '
            f"{error}."
        ) from None
    return MovementDistribution(text.strip(), (movement,))


def as_distribution(at: float | str | MovementDistribution, unit: str = "m") -> MovementDistribution:
    """Movement, its text or a distribution as a distribution."""
    if isinstance(at, MovementDistribution):
        return at
    return movement_distribution(at, unit) if isinstance(at, str) else MovementDistribution(f"{at:g}", (float(at),))


def _of_class(site: SiteClass) -> MovementDistribution:
    if not (math.isfinite(site.above) and math.isfinite(site.up_to)):
        low = 1e3 * max(site.above, 0.0)
        give = f'such as \'distribution = "uniform", lower = "{low:g} mm", upper = "{low + 25:g} mm"\''
        raise InputError(f"at = {site.name}: class {site.name} has no two limits of y_s; give a distribution, {give}.")
    share = (np.arange(POINTS) + 0.5) / POINTS
    points = site.above + share * (site.up_to - site.above)
    limits = f"{1e3 * site.above:g} to {1e3 * site.up_to:g} mm"
    even = f"y_s is taken as evenly distributed from {limits}"
    return MovementDistribution(f"class {site.name}", tuple(points.tolist()), even, MOUND)


def _distributed(text: str, unit: str) -> MovementDistribution:
    try:
        table: dict[str, Any] = tomllib.loads(f"at = {{ {text.strip().strip('{}')} }}")["at"]
    except tomllib.TOMLDecodeError as error:
        raise InputError(f"at = '{text}': is no table of a distribution: {error}.") from None
    from damagepred.scene.described import build

    marginal = build(Distribution, table, "at").frozen("at", unit)
    points = np.asarray(marginal.ppf((np.arange(POINTS) + 0.5) / POINTS), dtype=np.float64)
    words = ", ".join(f"{key} {value}" for key, value in table.items() if key != "distribution")
    family = table["distribution"]
    assumption = f"the movement is distributed: {family}, {words}"
    return MovementDistribution(f"a {family} movement", tuple(points.tolist()), assumption)
