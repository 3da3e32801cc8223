"""A study as a function of OpenTURNS and as the model of a SALib problem: Sobol's indices of both at the same points.

    python studies/hooks/run.py [BASE_POINTS]

Needs the packages openturns and SALib (in the extra `test`).
"""

import sys
from pathlib import Path

import numpy as np
import openturns as ot
from SALib.analyze import sobol

import damagepred
from damagepred.analyses.function import StudyFunction
from damagepred.uq.samplers import unit_points

STUDY = Path(__file__).with_name("house.toml")
OUTPUT = "dpc_opening_max"


def vectors(wall: StudyFunction, size: int) -> np.ndarray:
    """Rows of Saltelli's scheme: for each base point A, A with one input of B each, and B."""
    count = len(wall.inputs)
    a, b = np.split(unit_points("sobol", 2 * count, size, 1), 2, axis=1)
    rows = np.stack([a, *(np.where(np.arange(count) == k, b, a) for k in range(count)), b], axis=1)
    return wall.from_unit(rows.reshape(-1, count))


def wrapped(wall: StudyFunction) -> ot.Function:
    """The study's function as one of OpenTURNS: vector of inputs -> opening of the dpc (m) at the end."""

    def several(rows: object) -> np.ndarray:
        return wall(np.array(rows))[OUTPUT].values[:, None]

    function = ot.PythonFunction(len(wall.inputs), 1, func_sample=several)
    function.setInputDescription(wall.inputs)
    return function


def sobol_design(rows: np.ndarray, inputs: int) -> np.ndarray:
    """Points ordered base point by base point as OpenTURNS has them: all A, all B, all with one input from B."""
    table = rows.reshape(-1, inputs + 2, inputs)
    return np.concatenate([table[:, 0], table[:, -1], *(table[:, k + 1] for k in range(inputs))])


def with_openturns(size: int = 64) -> dict[str, np.ndarray]:
    """First and total indices by OpenTURNS (Jansen's estimators) at this package's own points."""
    wall = damagepred.Study.from_toml(STUDY).function([OUTPUT])
    design = ot.Sample(sobol_design(vectors(wall, size), len(wall.inputs)))
    algorithm = ot.JansenSensitivityAlgorithm(design, wrapped(wall)(design), size)
    return {"first": np.array(algorithm.getFirstOrderIndices()), "total": np.array(algorithm.getTotalOrderIndices())}


def with_salib(size: int = 64) -> dict[str, np.ndarray]:
    """First and total indices by SALib at this package's own points."""
    wall = damagepred.Study.from_toml(STUDY).function([OUTPUT])
    rows, names = vectors(wall, size), list(wall.inputs)
    # the rows already follow the study's distributions: SALib only reads the values, in the same order
    problem = {"num_vars": len(names), "names": names, "bounds": [[0.0, 1.0]] * len(names)}
    found = sobol.analyze(problem, wall(rows)[OUTPUT].values, calc_second_order=False, seed=1)
    return {"first": np.asarray(found["S1"]), "total": np.asarray(found["ST"])}


if __name__ == "__main__":
    for indices in (with_openturns, with_salib):
        found = indices(int(sys.argv[1]) if len(sys.argv) > 1 else 64)
        print(indices.__name__)
        for place, first, total in zip(damagepred.Study.from_toml(STUDY).function([OUTPUT]).inputs, *found.values()):
            print(f"{place:30} first {first:6.3f}   total {total:6.3f}")
