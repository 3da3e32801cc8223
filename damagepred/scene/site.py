"""Sites on reactive clay and the footings that go with them: tables of AS 2870, which are data with their source."""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from functools import cache
from typing import Any

from damagepred.errors import InputError, nearest
from damagepred.inputs.arguments import checked
from damagepred.inputs.data_files import data_file


@dataclass(frozen=True)
class SiteClass:
    """A class of sites by their characteristic surface movement.

    Attributes
    ----------
    name : str
        A, S, M, H1, H2 or E.
    above, up_to : float
        The surface movement y_s (m) is more than the one and at most the other: minus infinity for the first class,
        infinity for the last.
    description : str
        What ground it is.

    Examples
    --------
    >>> from damagepred import scene
    >>> h1 = scene.site_class(0.05)
    >>> h1.above, h1.up_to, h1.description
    (0.04, 0.06, 'highly reactive clay')
    """

    name: str
    above: float
    up_to: float
    description: str


@dataclass(frozen=True)
class StandardFooting:
    """A standard strip footing.

    Attributes
    ----------
    site_class : str
        Of the site, such as "M".
    construction : str
        Of the house, such as "full_masonry".
    depth, width : float
        Cross-section (m).
    mesh : str
        Trench mesh at the bottom and at the top, such as "4-L12TM".
    confidence : str
        Level of confidence (``data_files.CONFIDENCE``).

    Examples
    --------
    >>> from damagepred import scene
    >>> footing = scene.standard_footing("M", "masonry_veneer")
    >>> footing.depth, footing.width, footing.mesh
    (0.5, 0.3, '3-L12TM')
    """

    site_class: str
    construction: str
    depth: float
    width: float
    mesh: str
    confidence: str


@cache
def site_classes() -> tuple[SiteClass, ...]:
    """Return the classes of AS 2870-2011 Table 2.3, from the stillest to the most reactive.

    Examples
    --------
    >>> from damagepred import scene
    >>> [site.name for site in scene.site_classes()]
    ['A', 'S', 'M', 'H1', 'H2', 'E']
    """
    return tuple(
        SiteClass(c["name"], float(c.get("above", -math.inf)), float(c.get("up_to", math.inf)), c["description"])
        for c in _ground("site_classes")["class"]
    )


@checked
def site_class(surface_movement: float) -> SiteClass:
    """Return the class of a site.

    Parameters
    ----------
    surface_movement : float
        Characteristic surface movement y_s (m), not negative.

    Raises
    ------
    InputError
        If it is negative or not finite.

    Examples
    --------
    >>> from damagepred import scene
    >>> scene.site_class(0.05).name
    'H1'
    """
    if not (math.isfinite(surface_movement) and surface_movement >= 0):
        raise InputError(f"surface_movement = {surface_movement!r}: must be a finite number of metres, at least 0.")
    # a hair of tolerance: 40 mm computed as 40.000000000001 mm is 40 mm
    return next(c for c in site_classes() if surface_movement <= c.up_to * (1 + 1e-12))


def of_climatic_zone(table: str, zone: int) -> float:
    """Return the value of a climatic zone of AS 2870, 1 (wettest) to 6.

    Parameters
    ----------
    table : str
        Of data/ground/site_classes.toml: "suction_depth" (m), or "suction_change", the design change of suction at the
        surface (pF, assumed).
    zone : int
        Climatic zone.

    Raises
    ------
    InputError
        If there is no such zone.
    """
    values = _ground("site_classes")[table]
    if f"zone_{zone}" not in values:
        raise InputError(f"zone = {zone!r}: must be a climatic zone of AS 2870, 1 to 6.")
    return float(values[f"zone_{zone}"])


@checked
def suction_depth(zone: int) -> float:
    """Return the depth H_s (m) to which moisture changes in a climatic zone, 1 (wettest) to 6 (AS 2870-2011 Table 2.5).

    Raises
    ------
    InputError
        If there is no such zone.

    Examples
    --------
    >>> from damagepred import scene
    >>> scene.suction_depth(3)
    2.3
    """
    return of_climatic_zone("suction_depth", zone)


@cache
def standard_footings() -> tuple[StandardFooting, ...]:
    """Return the standard strip footings of which the table knows.

    Examples
    --------
    >>> from damagepred import scene
    >>> {footing.construction: footing.depth for footing in scene.standard_footings() if footing.site_class == "M"}
    {'clad_frame': 0.4, 'masonry_veneer': 0.5, 'full_masonry': 0.9}
    """
    return tuple(StandardFooting(**entry) for entry in _ground("footings")["footing"])


@checked
def standard_footing(site: str, construction: str) -> StandardFooting:
    """Return one standard strip footing.

    Parameters
    ----------
    site : str
        Class of the site, such as "M".
    construction : str
        Of the house, such as "full_masonry".

    Raises
    ------
    InputError
        If the table has none for them.

    Examples
    --------
    >>> from damagepred import scene
    >>> scene.standard_footing("M", "full_masonry").depth
    0.9
    """
    known = {f"{f.site_class} {f.construction}": f for f in standard_footings()}
    wanted = f"{site} {construction}"
    if wanted not in known:
        raise InputError(
            f"site class and construction = '{wanted}': no standard footing in data/ground/footings.toml; it has "
            f"{', '.join(known)}." + nearest(wanted, list(known))
        )
    return known[wanted]


@cache
def _ground(name: str) -> dict[str, Any]:
    return tomllib.loads(data_file("ground", f"{name}.toml").read_text(encoding="utf-8"))
