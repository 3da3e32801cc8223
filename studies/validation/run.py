"""All cases of the validation, one after the other, and the page over all.

    python studies/validation/run.py --workers 2

takes half an hour on two quiet cores. It goes on where it was stopped; `--only spandrels` runs one case.
"""

from __future__ import annotations

import argparse
import subprocess
import sys
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import pandas as pd

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE))

from studies.pages import put_in  # noqa: E402

CASES = (
    "spandrels",
    "shear_wall",
    "window_wall",
    "facades",
    "ramsgate",
    "bryant",
    "shear_panel",
)


def main() -> None:
    """Run cases, and write the page over all."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--only", choices=CASES)
    parser.add_argument("--page", action="store_true", help="write the page from the scores alone")
    asked = parser.parse_args()
    for case in () if asked.page else (asked.only,) if asked.only else CASES:
        command = [sys.executable, str(HERE / case / "run.py"), "--workers", str(asked.workers)]
        if code := subprocess.run(command, check=False).returncode:
            raise SystemExit(code)
    scores = {case: pd.read_csv(HERE / case / "scores.csv") for case in CASES if (HERE / case / "scores.csv").exists()}
    put_in(HERE / "README.md", over_all(scores))
    draw_pit(scores)


def over_all(scores: dict[str, pd.DataFrame]) -> str:
    """Return the table over all cases."""
    lines = [
        "| case | quantity | seen | predicted: mean, 5 to 95 % | predicted over seen | within 90 % |",
        "|---|---|---|---|---|---|",
    ]
    for case, rows in scores.items():
        for row in rows.itertuples():
            quantity = f"{row.quantity}, {row.unit}" + ("" if row.blind else " (updated)")
            lines.append(
                f"| [{case}]({case}/README.md) | {quantity} | {row.observed_mean:.3g} | {row.predicted_mean:.3g}, "
                f"{row.predicted_5:.3g} to {row.predicted_95:.3g} | {row.predicted_mean / row.observed_mean:.2f} | "
                f"{row.coverage_90:.2f} of {row.observations} |"
            )
    blind = pd.concat(scores.values()).query("blind")
    lines += [
        "",
        f"Of the {len(blind)} blind quantities, each with the same weight, intervals of 50 % "
        f"hold {blind.coverage_50.mean():.2f} of the observations and those of 90 % {blind.coverage_90.mean():.2f}.",
    ]
    return "\n".join(lines)


def draw_pit(scores: dict[str, pd.DataFrame]) -> None:
    """Draw where the observations lie in the blind predictions, each quantity with the same weight."""
    blind = pd.concat(scores.values()).query("blind")
    values = [np.array(str(text).split(), dtype=float) for text in blind.pit]
    figure, ax = plt.subplots(figsize=(6.0, 3.2), layout="constrained")
    weights = np.concatenate([np.full(len(v), 1.0 / len(v) / len(values)) for v in values])
    ax.hist(np.concatenate(values), bins=10, range=(0.0, 1.0), weights=10 * weights, color="0.75", edgecolor="black")
    ax.axhline(1.0, color="black", linestyle=":", linewidth=1.0)
    ax.set_xlabel("place of the observation in the predicted distribution (PIT)")
    ax.set_ylabel("density; dotted: if all were right")
    figure.savefig(HERE / "pit.png", dpi=110)
    plt.close(figure)


if __name__ == "__main__":
    main()
