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

from damagepred import solve  # noqa: E402
from damagepred.campaign.settings import StudySettings  # noqa: E402

DISTORTION = 1.0 / 500.0
"""Differential settlement of centre and end over half the length."""
STAGES, INCREMENTS = (0.5, 1.0), 8
"""Shares of the distortion to which walls are followed one after the other, and increments of the whole."""
PROFILES: dict[str, tuple[tuple[float, float], ...]] = {
    "one side from 1/3": ((0.0, 0.0), (1 / 3, 0.0), (1.0, -2 / 3)),
    "one side from 1/2": ((0.0, 0.0), (1 / 2, 0.0), (1.0, -1 / 2)),
    "one side from 2/3": ((0.0, 0.0), (2 / 3, 0.0), (1.0, -1 / 3)),
    "both sides": ((0.0, -1 / 2), (1 / 2, 0.0), (1.0, -1 / 2)),
}
"""Ground under a hogging facade, straight with one kink: place / length, level / (length x distortion)."""
LEVEL = 2.5
"""Of Psi."""
ANGLES = {0: 1300.0, 2: 150.0}
"""Facade -> one over the distortion at which the source quotes the level (which facades: by their order, assumed)."""
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


def movement(facade: Facade, profile: str, distortion: float, increments: int) -> dict[str, Any]:
    """Table ``[movement]`` of a profile; more points beside the kink hold the curve through them straight."""
    points = dict(PROFILES[profile])
    x, y = list(points), list(points.values())
    table = sorted({(p, float(np.interp(p, x, y))) for p in (*x, *(x[1] + side for side in (-0.03, 0.03)))})
    middle = float(np.interp(0.5, x, y)) - 0.5 * (y[0] + y[-1])
    deflection = middle * distortion * facade.length
    return {
        "shape": "table",
        "table": [list(point) for point in table],
        "kind": "doming",
        "central_deflection": deflection,
        "increments": increments,
    }


def facade_settings(facade: Facade, profile: str, distortion: float, increments: int, **changes: Any) -> StudySettings:
    """Settings of a facade's study, to an angular distortion beyond the kink."""
    return settings_of(
        HERE / "facade.toml",
        scene__wall={"length": facade.length, "height": facade.height},
        scene__loads={"roof": 5e3 * facade.length},
        scene__opening=facade.tables(),
        scene__movement=movement(facade, profile, distortion, increments),
        **changes,
    )


def share_beyond(facade: Facade, profile: str, folder: Path, samples: int, workers: int) -> float:
    """Share of walls whose Psi has passed the level up to the distortion.

    Walls are followed no farther than the stage at which all of them have: damage does not heal.
    """
    for stage in STAGES:
        settings = facade_settings(facade, profile, stage * DISTORTION, round(stage * INCREMENTS))
        place = folder / f"{facade.name}_{profile}_{stage:g}.dp".replace(" ", "").replace("/", "of")
        beyond = np.nanmax(run_study(settings, place, samples, workers)["psi"].values, axis=1) > LEVEL
        if beyond.all():
            break
    return float(beyond.mean())


def angle(facade: Facade, profile: str, folder: Path) -> float:
    """One over the angular distortion at which Psi of a mean wall passes the level; 0 where it does not by 1/100."""
    place = folder / f"{facade.name}_{profile}.txt".replace(" ", "").replace("/", "of")
    if not place.exists():
        ds = solve(facade_settings(facade, profile, 0.01, 20).scene)
        distortion = 0.01 * ds["central_deflection"].values / movement(facade, profile, 0.01, 20)["central_deflection"]
        reached = np.interp(LEVEL, np.maximum.accumulate(ds["psi"].values), distortion, right=np.inf)
        place.write_text(f"{1.0 / reached:.1f}", encoding="utf-8")
    return float(place.read_text(encoding="utf-8"))


def angles(folder: Path) -> list[str]:
    """Table of the distortions of mean walls beside those that the source quotes."""
    lines = [f"| facade, m | source | {' | '.join(PROFILES)} |", "|---|---|---|---|---|---|"]
    for i, seen in ANGLES.items():
        found = [angle(FACADES[i], profile, folder) for profile in PROFILES]
        cells = [f"1/{value:.0f}" if value else "not by 1/100" for value in found]
        lines.append(f"| {FACADES[i].name} | 1/{seen:.0f} | {' | '.join(cells)} |")
    return lines


def run(folder: Path, samples: int, workers: int) -> tuple[list[dict[str, Any]], str]:
    """Run all facades under all profiles; return no rows, and the table of shares."""
    lines = [f"| facade, m | length over height | {' | '.join(PROFILES)} | all |", "|---|---|---|---|---|---|---|"]
    shares = {}
    for facade in FACADES:
        beyond = [share_beyond(facade, profile, folder, samples, workers) for profile in PROFILES]
        shares[facade] = float(np.mean(beyond))
        ratio = facade.length / facade.height
        lines.append(
            f"| {facade.name} | {ratio:.2f} | {' | '.join(f'{b:.2f}' for b in beyond)} | {shares[facade]:.2f} |"
        )
    mean = float(np.mean(list(shares.values())))
    slender = [shares[f] for f in FACADES if f.length / f.height > 2.5]
    stout = [shares[f] for f in FACADES if f.length / f.height <= 2.5]
    lines += [
        "",
        f"Beyond Psi {LEVEL} at 1/500: {mean:.2f} of all, against {SEEN} in the source. Of those longer than 2.5 times "
        f"their height {np.mean(slender):.2f}, of the others {np.mean(stout):.2f}.",
        "",
        f"Distortion at which a wall without scatter passes Psi {LEVEL}:",
        "",
        *angles(folder),
    ]
    return [], "\n".join(lines)


if __name__ == "__main__":
    case_main(HERE, 6, run)
