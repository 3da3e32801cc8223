"""Facades under settlement: share beyond Psi 2.5 at an angular distortion of 1/500, by length over height.

    python studies/validation/facades/run.py --samples 6 --workers 2

takes a quarter of an hour, goes on where it was stopped, and writes the tables of the README.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from judging import case_main, run_study, settings_of  # noqa: E402

DISTORTION = 1.0 / 500.0
"""Differential settlement of centre and end over half the length."""
STAGES, INCREMENTS = (0.5, 1.0), 8
"""Shares of the distortion to which walls are followed one after the other, and increments of the whole."""
LEVEL = 2.5
"""Of Psi."""
SEEN = 0.2
"""Share of the runs of the source that exceed it, over all facades and shapes (reported)."""


class Facade(NamedTuple):
    """A facade: size (m), and its openings as (columns, rows, width, height)."""

    length: float
    height: float
    openings: tuple[int, int, float, float]

    @property
    def name(self) -> str:
        """Its size in words."""
        return f"{self.length:g} x {self.height:g}"

    def tables(self) -> list[dict[str, float]]:
        """Return its windows, evenly spread."""
        columns, rows, width, height = self.openings
        across, up = (self.length - columns * width) / (columns + 1), (self.height - rows * height) / (rows + 1)
        return [
            {"x": across + i * (across + width), "y": up + j * (up + height), "width": width, "height": height}
            for i in range(columns)
            for j in range(rows)
        ]


FACADES = (
    Facade(7.0, 5.5, (2, 2, 1.5, 1.5)),
    Facade(5.5, 5.5, (2, 2, 1.2, 1.2)),
    Facade(7.0, 7.0, (2, 2, 1.5, 1.6)),
    Facade(17.0, 3.8, (4, 1, 1.2, 1.2)),
    Facade(6.8, 7.1, (2, 2, 1.5, 1.6)),
    Facade(12.0, 3.0, (3, 1, 1.4, 1.5)),
)


def share_beyond(facade: Facade, kind: str, folder: Path, samples: int, workers: int) -> float:
    """Return the share of walls whose Psi has passed the level up to the distortion.

    Walls are followed no farther than the stage at which all of them have: damage does not heal.
    """
    for stage in STAGES:
        deflection = stage * DISTORTION * facade.length / 2.0
        settings = settings_of(
            HERE / "facade.toml",
            scene__wall={"length": facade.length, "height": facade.height},
            scene__loads={"roof": 5e3 * facade.length},
            scene__opening=facade.tables(),
            scene__movement={"kind": kind, "central_deflection": deflection, "increments": round(stage * INCREMENTS)},
        )
        place = folder / f"{facade.name.replace(' ', '')}_{kind}_{stage:g}.dp"
        beyond = np.nanmax(run_study(settings, place, samples, workers)["psi"].values, axis=1) > LEVEL
        if beyond.all():
            break
    return float(beyond.mean())


def run(folder: Path, samples: int, workers: int) -> tuple[list[dict[str, Any]], str]:
    """Run all facades in both shapes; return no rows, and the table of shares."""
    lines = ["| facade, m | length over height | sagging | hogging | both |", "|---|---|---|---|---|"]
    shares = {}
    for facade in FACADES:
        beyond = [share_beyond(facade, kind, folder, samples, workers) for kind in ("dishing", "doming")]
        shares[facade] = float(np.mean(beyond))
        ratio = facade.length / facade.height
        lines.append(f"| {facade.name} | {ratio:.2f} | {beyond[0]:.2f} | {beyond[1]:.2f} | {shares[facade]:.2f} |")
    mean = float(np.mean(list(shares.values())))
    slender = [shares[f] for f in FACADES if f.length / f.height > 2.5]
    stout = [shares[f] for f in FACADES if f.length / f.height <= 2.5]
    lines += [
        "",
        f"Beyond Psi {LEVEL} at 1/500: {mean:.2f} of all, against {SEEN} in the source. Of those longer than 2.5 times "
        f"their height {np.mean(slender):.2f}, of the others {np.mean(stout):.2f}.",
    ]
    return [], "\n".join(lines)


if __name__ == "__main__":
    case_main(HERE, 6, run)
