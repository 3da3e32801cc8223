"""Random scenes, as a user could write them: tables for ``Scene.from_dict``, determined by a number."""

from __future__ import annotations

from typing import Any

import numpy as np

SEED = 2026


def tables(number: int, most: int = 60, rng: np.random.Generator | None = None) -> dict[str, Any]:
    """Return the tables of a scene of about ``most`` blocks, from a generator, by default seeded with the number."""
    rng = np.random.default_rng([SEED, number]) if rng is None else rng

    def log(low: float, high: float) -> float:
        return float(10.0 ** rng.uniform(np.log10(low), np.log10(high)))

    def sometimes(share: float, low: float, high: float) -> float:
        return log(low, high) if rng.random() > share else 0.0

    courses, units = int(rng.integers(1, 9)), int(rng.integers(1, 9))
    while courses * units > most:
        courses, units = max(1, courses // 2), max(1, units // 2)
    block_length, block_height = round(log(0.05, 1.0), 3), round(log(0.03, 0.5), 3)
    length, height = round(units * block_length, 4), round(courses * block_height, 4)
    friction = float(rng.choice([0.0, 0.3, 0.75, 1.2, 2.0]))
    strength, cohesion = sometimes(0.2, 1e2, 1e8), sometimes(0.2, 1e2, 1e8)
    joint: dict[str, Any] = {
        "normal_stiffness": log(1e8, 1e13),
        "tensile_strength": strength,
        "cohesion": cohesion,
        "friction": friction,
    }
    joint["shear_stiffness"] = joint["normal_stiffness"] * log(0.05, 2.0)
    law = rng.choice(["plain", "plain", "plain", "dilation", "brittle_shear", "softening", "residual"])
    if law == "dilation":
        joint["dilation"] = friction * float(rng.uniform(0.0, 1.0))
    elif law == "brittle_shear":
        joint["brittle_shear"] = True
    elif law == "softening":
        joint["fracture_energy"] = log(0.1, 100.0)
    elif law == "residual":
        joint |= {"residual_cohesion": 0.1 * cohesion, "residual_friction": 0.7 * friction}
    found: dict[str, Any] = {
        "title": f"random scene {number}",
        "wall": {
            "length": length,
            "height": height,
            "block_length": block_length,
            "block_height": block_height,
            "thickness": log(0.05, 0.5),
            "bond": str(rng.choice(["running", "running", "stack"])),
        },
        "block": {"elastic_modulus": log(1e8, 1e11), "density": sometimes(0.05, 1e2, 1e4)},
        "joint": joint,
        "movement": {
            "kind": str(rng.choice(["dishing", "doming"])),
            "central_deflection": sometimes(0.05, 1e-7, 0.1),
            "increments": int(rng.choice([1, 2, 5])),
            "shape": str(rng.choice(["three_loads", "parabola", "arc"])),
        },
        "loads": {"roof": sometimes(0.4, 10.0, 1e5)},
    }
    if rng.random() < 0.4 and courses > 1:
        found["dpc"] = {"course": 1, "friction": float(rng.uniform(0.0, 1.0))}
    if rng.random() < 0.3 and courses > 2 and units > 2:
        wide, high = float(rng.uniform(0.2, 0.6)) * length, float(rng.uniform(0.2, 0.6)) * height
        found["opening"] = [
            {
                "x": round(float(rng.uniform(0.1, 0.9)) * (length - wide), 3),
                "width": round(wide, 3),
                "y": round(float(rng.uniform(0.1, 0.9)) * (height - high), 3),
                "height": round(high, 3),
            }
        ]
    return found
