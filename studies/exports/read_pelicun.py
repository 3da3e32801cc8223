"""Damage states of an exported damage model, computed by pelicun. Runs in pelicun's environment: see run.py.

    python read_pelicun.py curves_pelicun.csv DEMAND_UNIT LEVEL...

Prints as JSON the medians and dispersions it loaded, and the share of walls at each level of the demand that reached
each damage state or a worse one, in 200 000 realisations.
"""

import json
import sys
from pathlib import Path

import pandas as pd
from pelicun.assessment import Assessment

SIZE = 200_000
"""Realisations."""


def main() -> None:
    file, unit, *levels = sys.argv[1:]
    options = json.loads(Path(file).with_suffix(".json").read_text())
    (demand,) = options["CustomDemandTypes"].values()
    asset = Assessment(options | {"PrintLog": False, "Seed": 1})

    # one location per level, so one run gives all levels
    columns = {(demand["Acronym"], str(i), "1"): [unit, *[float(level)] * SIZE] for i, level in enumerate(levels, 1)}
    demands = pd.DataFrame(columns, index=["Units", *range(SIZE)])
    asset.demand.load_sample(demands)

    asset.stories = len(levels)
    component = pd.read_csv(file)["ID"][0]
    where = {"Units": "ea", "Location": f"1--{len(levels)}", "Direction": "1", "Theta_0": "1", "Blocks": "1"}
    asset.asset.load_cmp_model({"marginals": pd.DataFrame([where], index=[component])})
    asset.asset.generate_cmp_sample(SIZE)

    asset.damage.load_model_parameters([file], {component})
    loaded = asset.damage.ds_model.damage_params.loc[component]
    asset.damage.calculate()
    shares = asset.damage.ds_model.probabilities().droplevel([0, 2, 3, 4])
    shares.index = shares.index.astype(int)
    states = sorted({name for name, _ in loaded.index if name.startswith("LS")})
    worse = [
        [
            float(shares.loc[place, [s for s in shares.columns if s >= number]].sum())
            for place in range(1, len(levels) + 1)
        ]
        for number in range(1, len(states) + 1)
    ]
    print(
        json.dumps(
            {
                "median": [float(loaded[s, "Theta_0"]) for s in states],
                "dispersion": [float(loaded[s, "Theta_1"]) for s in states],
                "probability": worse,
            }
        )
    )


main()
