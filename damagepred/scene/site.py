"""Sites on reactive clay and their standard footings: tables of AS 2870, from data files with sources."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cache

from damagepred.errors import InputError, nearest
from damagepred.inputs.arguments import checked
from damagepred.inputs.data_files import data_tables
from damagepred.inputs.documentation import documented


@documented
@dataclass(frozen=True)
class SiteClass:
    """Site class by the characteristic surface movement.

    Examples
    --------
    >>> from damagepred import scene
    >>> h1 = scene.site_class(0.05)
    >>> h1.above, h1.up_to, h1.description
    (0.04, 0.06, 'highly reactive clay')
    """

    name: str
    """A, S, M, H1, H2 or E."""
    above: float
    up_to: float
    """Bounds of the surface movement y_s (m), lower excluded: minus infinity for the first class, infinity for the
    last."""
    description: str
    """Type of ground."""


@documented
@dataclass(frozen=True)
class StandardFooting:
    """Standard strip footing.

    Examples
    --------
    >>> from damagepred import scene
    >>> footing = scene.standard_footing("M", "masonry_veneer")
    >>> footing.depth, footing.width, footing.mesh
    (0.5, 0.3, '3-L12TM')
    """

    site_class: str
    """Class of the site, such as "M"."""
    construction: str
    """Construction of the house, such as "full_masonry"."""
    depth: float
    width: float
    """Cross-section (m)."""
    mesh: str
    """Trench mesh at the bottom and at the top, such as "4-L12TM"."""
    confidence: str
    """Level of confidence (``data_files.CONFIDENCE``)."""


@cache
def site_classes() -> tuple[SiteClass, ...]:
    """Classes of AS 2870-2011 Table 2.3, from stable to extremely reactive.

    Examples
    --------
    >>> from damagepred import scene
    >>> [site.name for site in scene.site_classes()]
    ['A', 'S', 'M', 'H1', 'H2', 'E']
    """
    return tuple(
        SiteClass(c["name"], float(c.get("above", -math.inf)), float(c.get("up_to", math.inf)), c["description"])
        for c in data_tables("ground", "site_classes.toml")["class"]
    )


@checked
def site_class(surface_movement: float) -> SiteClass:
    """Class of a site by its characteristic surface movement y_s (m), not negative.

    Examples
    --------
    >>> from damagepred import scene
    >>> scene.site_class(0.05).name
    'H1'
    """
    if not (math.isfinite(surface_movement) and surface_movement >= 0):
        raise InputError(f"surface_movement = {surface_movement!r}: must be a finite number of metres, at least 0.")
    # tolerance: 40 mm computed as 40.000000000001 mm is 40 mm
    return next(c for c in site_classes() if surface_movement <= c.up_to * (1 + 1e-12))


def of_climatic_zone(table: str, zone: int) -> float:
    """Value of a climatic zone of AS 2870, 1 to 6: "suction_depth" (m), or "suction_change" (pF, assumed)."""
    values = data_tables("ground", "site_classes.toml")[table]
    if f"zone_{zone}" not in values:
        raise InputError(f"zone = {zone!r}: must be a climatic zone of AS 2870, 1 to 6.")
    return float(values[f"zone_{zone}"])


@checked
def suction_depth(zone: int) -> float:
    """Depth H_s (m) of changes in moisture in a climatic zone, 1 (wettest) to 6 (AS 2870-2011 Table 2.5).

    Examples
    --------
    >>> from damagepred import scene
    >>> scene.suction_depth(3)
    2.3
    """
    return of_climatic_zone("suction_depth", zone)


@cache
def standard_footings() -> tuple[StandardFooting, ...]:
    """Standard strip footings (AS 2870).

    Examples
    --------
    >>> from damagepred import scene
    >>> {footing.construction: footing.depth for footing in scene.standard_footings() if footing.site_class == "M"}
    {'clad_frame': 0.4, 'masonry_veneer': 0.5, 'full_masonry': 0.9}
    """
    return tuple(StandardFooting(**entry) for entry in data_tables("ground", "footings.toml")["footing"])


@checked
def standard_footing(site: str, construction: str) -> StandardFooting:
    """Standard strip footing of a site class and construction.

    Parameters
    ----------
    site : str
        Class of the site, such as "M".
    construction : str
        Construction of the house, such as "full_masonry".

    Examples
    --------
    >>> from damagepred import scene
    >>> scene.standard_footing("M", "full_masonry").depth
    0.9
    """
    footings = {f"{f.site_class} {f.construction}": f for f in standard_footings()}
    wanted = f"{site} {construction}"
    if wanted not in footings:
        raise InputError(
            f"site class and construction = '{wanted}': no standard footing in data/ground/footings.toml; it has "
            f"{', '.join(footings)}." + nearest(wanted, list(footings))
        )
    return footings[wanted]
