"""Influence of the soil's stiffness on damage: one wall on softer and stiffer ground.

python studies/soil_movement/stiffness.py [--movement 100]
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace

from run import settings

from damagepred import solve

STIFFNESS = {"dishing": (1e6, 2e6, 4e6, 8e6), "doming": (1.25e6, 2.5e6, 5e6, 10e6)}
"""Stiffness of the soil (Pa/m), around the defaults of swelling and of shrinking soil."""


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--movement", type=float, default=100.0, help="y_s (mm)")
    options = parser.parse_args()
    print(f"Mean wall on the 500 x 300 footing at y_s = {options.movement:g} mm, draft accuracy")
    print("movement  soil (kPa/m)  deflection of the footing (mm)  widest joint (mm)  category")
    for kind, values in STIFFNESS.items():
        scene = settings("veneer", kind, options.movement).scene
        scene = replace(
            scene, solver=scene.solver.with_accuracy("draft"), movement=replace(scene.movement, increments=5)
        )
        for value in values:
            soil = replace(scene.soil, swelling_stiffness=value, shrinking_stiffness=value)
            wall = solve(replace(scene, soil=soil)).isel(increment=-1)
            deflection, width = 1e3 * float(wall["central_deflection"]), 1e3 * float(wall["crack_width_max"])
            print(f"{kind:9} {value / 1e3:12g}  {deflection:30.2f}  {width:17.3f}  {int(wall['damage_category']):8}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
