"""Probabilities of an exported fragility model, computed by OpenQuake. Runs in OpenQuake's environment: see run.py.

    python read_openquake.py curves_openquake.xml LEVEL...

Prints as JSON the probability of each limit state at each level (in the unit of the file).
"""

import json
import sys

import numpy as np
from openquake.hazardlib import nrml
from openquake.risklib import read_nrml

read_nrml.update_validators()


def main() -> None:
    file, *levels = sys.argv[1:]
    model = nrml.to_python(file)
    ((intensity, name),) = model
    functions = model[intensity, name].build(model.limitStates)
    at = np.array(levels, dtype=float)
    print(
        json.dumps(
            {
                "intensity": intensity,
                "limit_states": model.limitStates,
                "probability": [function(at.copy()).tolist() for function in functions],
            }
        )
    )


main()
