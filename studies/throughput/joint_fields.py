"""Time to sample the joints of one wall: every distribution and every form of field, on the 816-block wall.

Run: python studies/throughput/joint_fields.py [--repeats 20]
"""

from __future__ import annotations

import argparse
import time
import tomllib
from pathlib import Path
from typing import Any

import pandas as pd

from damagepred.campaign.sample import joint_places
from damagepred.campaign.settings import StudySettings
from damagepred.scene import Scene

HERE = Path(__file__).resolve().parent
DATA = HERE.parents[1] / "data"

LOGNORMAL = {"distribution": "lognormal", "mean": 453e3, "cov": 0.3}
FAMILIES: dict[str, dict[str, Any]] = {
    "lognormal": LOGNORMAL,
    "normal": {"distribution": "normal", "mean": 453e3, "cov": 0.1},
    "truncated_normal": {
        "distribution": "truncated_normal",
        "mean": 453e3,
        "cov": 0.3,
        "lower": 1e5,
        "upper": 1e6,
    },
    "uniform": {"distribution": "uniform", "lower": 2e5, "upper": 7e5},
    "weibull": {"distribution": "weibull", "mean": 453e3, "cov": 0.3},
    "gamma": {"distribution": "gamma", "mean": 453e3, "cov": 0.3},
    "beta": {"distribution": "beta", "lower": 1e5, "upper": 1e6, "mean": 453e3, "cov": 0.3},
    "discrete": {"distribution": "discrete", "values": [2e5, 4e5, 6e5]},
    "empirical": {"distribution": "empirical", "values": [float(v) for v in range(200_000, 700_000, 10_000)]},
    "scipy: gumbel_r": {"distribution": "scipy", "name": "gumbel_r", "parameters": {"loc": 4e5, "scale": 5e4}},
    "scipy: skewnorm": {
        "distribution": "scipy",
        "name": "skewnorm",
        "parameters": {"a": 2.0, "loc": 4e5, "scale": 5e4},
    },
    "mixture": {
        "distribution": "mixture",
        "components": [{"weight": 95, **LOGNORMAL}, {"weight": 5, **LOGNORMAL, "mean": 226e3}],
    },
    "mixture with an atom": {
        "distribution": "mixture",
        "components": [{"weight": 95, **LOGNORMAL}, {"weight": 5, "distribution": "discrete", "values": [1e3]}],
    },
}
FIELDS: dict[str, dict[str, Any]] = {
    "along courses": {"course_correlation": 0.4},
    "over the wall": {"correlation_length": 0.5},
}


def study(family: dict[str, Any], field: dict[str, Any]) -> StudySettings:
    """Return a study in which tensile strength and cohesion vary from joint to joint, correlated with each other."""
    scene = tomllib.loads((DATA / "bryant_dishing.toml").read_text(encoding="utf-8"))
    places = ("joint.tensile_strength", "joint.cohesion")
    return StudySettings.from_dict(
        {
            "scene": scene,
            "study": {"samples": 8},
            "variables": {p: {**family, "field": field} for p in places},
            "correlation": {places[0]: {places[1]: 0.7}},
        }
    )


def measure(settings: StudySettings, repeats: int) -> tuple[float, float]:
    """Return the time to draw two fields for the first time, and the least for one more sample (ms)."""
    began = time.perf_counter()
    design, places = settings.design(), joint_places(settings.scene)
    design.joint_values(0, places)
    first = time.perf_counter() - began
    times = []
    for sample in range(1, repeats + 1):
        began = time.perf_counter()
        design.joint_values(sample, joint_places(settings.scene))
        times.append(time.perf_counter() - began)
    return 1e3 * first, 1e3 * min(times)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--repeats", type=int, default=20, help="samples, of which the quickest counts")
    parser.add_argument("--results", type=Path, default=HERE / "results" / "joint_fields.csv", help="table to write")
    options = parser.parse_args()
    joints = len(joint_places(Scene.from_toml(DATA / "bryant_dishing.toml")).x)
    rows = []
    for family, stated in FAMILIES.items():
        row: dict[str, Any] = {"distribution": family}
        for name, field in FIELDS.items():
            row[f"first, {name}"], row[name] = measure(study(stated, field), options.repeats)
        rows.append(row)
    found = pd.DataFrame(rows).set_index("distribution")
    print(f"two fields of {joints} joints, milliseconds a sample:\n{found.round(2).to_string()}")
    options.results.parent.mkdir(parents=True, exist_ok=True)
    found.to_csv(options.results)


if __name__ == "__main__":
    main()
