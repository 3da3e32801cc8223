"""All families of cases, by name."""

from __future__ import annotations

from functools import cache

from studies.benchmarks.stress import collapse, elastic, geometry, in_time, joints, random_scenes
from studies.benchmarks.stress.case import Case


@cache
def all_cases() -> dict[tuple[str, str], Case]:
    """Return every case by family and name, in the order of the page."""
    listed = [case for part in (elastic, joints, collapse, geometry, in_time, random_scenes) for case in part.cases()]
    found = {(case.family, case.name): case for case in listed}
    if len(found) != len(listed):
        raise ValueError("two cases have one name")
    return found
