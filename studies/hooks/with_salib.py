"""A study as the model of a SALib problem: the same points, the same Sobol indices.

    python studies/hooks/with_salib.py [BASE_POINTS]

Needs the package SALib (in the extra `test`).
"""

import sys
from pathlib import Path

import numpy as np
from SALib.analyze import sobol

import damagepred

STUDY = Path(__file__).with_name("house.toml")
OUTPUT = "dpc_opening_max"


def main(size: int = 64) -> dict[str, np.ndarray]:
    """Return first and total indices by SALib at this package's own points."""
    wall = damagepred.Study.from_toml(STUDY).function([OUTPUT])
    rows, _, names = wall.sobol_rows(size, seed=1)
    # the rows already follow the study's distributions: SALib only reads the values, in the same order
    problem = {"num_vars": len(names), "names": names, "bounds": [[0.0, 1.0]] * len(names)}
    found = sobol.analyze(problem, wall(rows)[OUTPUT].values, calc_second_order=False, seed=1)
    return {"first": np.asarray(found["S1"]), "total": np.asarray(found["ST"])}


if __name__ == "__main__":
    found = main(int(sys.argv[1]) if len(sys.argv) > 1 else 64)
    for place, first, total in zip(damagepred.Study.from_toml(STUDY).function([OUTPUT]).inputs, *found.values()):
        print(f"{place:30} first {first:6.3f}   total {total:6.3f}")
