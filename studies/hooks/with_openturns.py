"""A study as a function of OpenTURNS: its distributions, its design, its Sobol indices.

    python studies/hooks/with_openturns.py [BASE_POINTS]

Needs the package openturns (in the extra `test`).
"""

import sys
from pathlib import Path

import numpy as np
import openturns as ot

import damagepred
from damagepred.analyses.function import StudyFunction

STUDY = Path(__file__).with_name("house.toml")
OUTPUT = "dpc_opening_max"


def wrapped(wall: StudyFunction) -> ot.Function:
    """Return the study's function as one of OpenTURNS: vector of inputs -> opening of the dpc (m) at the end."""

    def several(rows: object) -> np.ndarray:
        return wall(np.array(rows))[OUTPUT].values[:, None]

    function = ot.PythonFunction(len(wall.inputs), 1, func_sample=several)
    function.setInputDescription(wall.inputs)
    return function


def sobol_design(rows: np.ndarray, inputs: int) -> np.ndarray:
    """Return points ordered base point by base point as OpenTURNS has them: all A, all B, all with one input from B."""
    table = rows.reshape(-1, inputs + 2, inputs)
    return np.concatenate([table[:, 0], table[:, -1], *(table[:, k + 1] for k in range(inputs))])


def main(size: int = 64) -> dict[str, np.ndarray]:
    """Return first and total indices by OpenTURNS (Jansen's estimators) at this package's own points."""
    wall = damagepred.Study.from_toml(STUDY).function([OUTPUT])
    rows, _, names = wall.sobol_rows(size, seed=1)
    design = ot.Sample(sobol_design(rows, len(names)))
    algorithm = ot.JansenSensitivityAlgorithm(design, wrapped(wall)(design), size)
    return {"first": np.array(algorithm.getFirstOrderIndices()), "total": np.array(algorithm.getTotalOrderIndices())}


if __name__ == "__main__":
    found = main(int(sys.argv[1]) if len(sys.argv) > 1 else 64)
    for place, first, total in zip(damagepred.Study.from_toml(STUDY).function([OUTPUT]).inputs, *found.values()):
        print(f"{place:30} first {first:6.3f}   total {total:6.3f}")
