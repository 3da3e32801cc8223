"""Load, displacement and cracks of the shear panel J4D: brittle against softening joints, with and without a cap.

    python studies/shear_panel/run.py [--increments 160] [--no-explicit] [--output studies/shear_panel]

Prints the table of the README and draws its two pictures.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import xarray as xr
from panel import BRITTLE, PEAK_OF_TEST, SOFT, SOFT_IN_SHEAR, panel

import damagepred
from damagepred.plotting import draw_wall
from damagepred.plotting.sheet import new_figure, small, text_size
from damagepred.scene import Joint, Solver

HERE = Path(__file__).resolve().parent
PUSH = 4e-3
"""Displacement of the top (m)."""
DROP = 0.02
"""Share by which the force must drop after a peak."""

CAP = 10.5e6
"""Compressive strength (Pa): of the panel's masonry, assumed (Lourenco and Rots 1997)."""


JOINTS = {"brittle": BRITTLE, "softening in tension": SOFT, "softening in tension and shear": SOFT_IN_SHEAR}


@dataclass(frozen=True)
class Case:
    """One curve."""

    name: str
    joint: Joint
    cap: bool
    bricks_crack: bool
    method: str = "quasi_static"

    def solve(self, increments: int, push: float = PUSH) -> Curve:
        """Solve it up to a displacement of the top (m)."""
        joint = replace(self.joint, compressive_strength=CAP if self.cap else None)
        pushed = panel(joint, push=push, bricks_crack=self.bricks_crack)
        tolerance = 1e-3 if self.method == "explicit" else None
        began = time.perf_counter()
        ds = damagepred.solve(
            pushed.assembly,
            solver=Solver(method=self.method, tolerance=tolerance),  # type: ignore[arg-type]
            increments=increments,
            on_failure="return",
        )
        seconds = time.perf_counter() - began
        return Curve(self, ds, ds["block_support_force_x"].values[:, pushed.beam], seconds)


@dataclass(frozen=True)
class Curve:
    """Result."""

    case: Case
    ds: xr.Dataset
    force: np.ndarray
    seconds: float

    @property
    def moved(self) -> np.ndarray:
        """Displacement of the top (m)."""
        return self.ds["block_displacement_x"].values[:, -1]

    def first_peak(self) -> int:
        """Return the increment of the first peak, after which the force drops by a share before it rises again."""
        highest = 0
        for i in range(len(self.force)):
            if self.force[i] > self.force[highest]:
                highest = i
            elif self.force[i] < (1 - DROP) * self.force[highest] - 1.0:
                return highest
        return highest

    def row(self) -> str:
        """Return its row of the table."""
        first, most = self.first_peak(), int(self.force.argmax())
        cells = (
            self.case.name,
            "crack" if self.case.bricks_crack else "whole",
            "yes" if self.case.cap else "no",
            self.case.method.replace("_", "-"),
            *(f"{self.force[i] / 1e3:.1f} kN at {self.moved[i] * 1e3:.2f} mm" for i in (first, most)),
            f"{self.force[-1] / 1e3:.1f} kN",
            f"{self.seconds:.1f} s",
        )
        return "| " + " | ".join(cells) + " |"


def cases(explicit: bool) -> list[Case]:
    """Return all curves."""
    listed = [
        Case(name, joint, cap, split)
        for split in (False, True)
        for cap in (False, True)
        for name, joint in JOINTS.items()
    ]
    if explicit:
        listed += [Case(name, joint, True, True, "explicit") for name, joint in JOINTS.items()]
    return listed


def draw_curves(curves: list[Curve], file: Path) -> None:
    """Draw force over displacement: on the left uncracked bricks, on the right bricks that may crack."""
    figure = new_figure(13.0, 6.2)
    axes = figure.subplots(1, 2, sharey=True)
    names = list(JOINTS)
    for ax, split in zip(axes, (False, True), strict=True):
        for curve in curves:
            if curve.case.bricks_crack != split:
                continue
            explicit = curve.case.method == "explicit"
            cap = curve.case.cap
            ax.plot(
                curve.moved * 1e3,
                curve.force / 1e3,
                color=f"C{names.index(curve.case.name)}",
                linestyle=":" if explicit else "-" if cap else "--",
                linewidth=1.6 if cap else 1.0,
                label=curve.case.name + (", cap" if cap else "") + (", explicit" if explicit else ""),
            )
        ax.axhline(PEAK_OF_TEST / 1e3, color="0.4", linestyle="-.", linewidth=1.0, label="peak of the test, about")
        ax.set_title("bricks may crack in the middle" if split else "bricks stay whole", fontsize=text_size(ax))
        ax.set_xlabel("displacement of the top (mm)")
        ax.set_xlim(0, PUSH * 1e3)
        ax.set_ylim(bottom=0)
        ax.grid(alpha=0.3)
        ax.legend(fontsize=small(ax), loc="upper left")
    axes[0].set_ylabel("horizontal force (kN)")
    figure.savefig(file, dpi=110)


def draw_cracks(curves: list[Curve], file: Path) -> None:
    """Draw the cracks just after the first peak, and at the end, where bricks may crack and joints have a cap."""
    figure = new_figure(5.6 * len(curves), 13.0)
    axes = figure.subplots(2, len(curves), squeeze=False)
    for column, curve in enumerate(curves):
        after = min(curve.first_peak() + 4, len(curve.force) - 1)
        for ax, increment in zip(axes[:, column], (after, len(curve.force) - 1), strict=True):
            draw_wall(curve.ds, ax, increment=increment)
            scale = ax.get_title(loc="left").splitlines()[-1].removeprefix("displacements ")
            ax.set_title("", loc="left")
            at = f"{curve.moved[increment] * 1e3:.2f} mm, {curve.force[increment] / 1e3:.0f} kN"
            ax.set_title(f"{curve.case.name}:\n{at}; {scale}", fontsize=text_size(ax))
    figure.savefig(file, dpi=80)


def print_agreement(curves: list[Curve]) -> None:
    """Print the differences of the two solvers, up to some displacements."""
    for explicit in (c for c in curves if c.case.method == "explicit"):
        other = next(c for c in curves if c.case == replace(explicit.case, method="quasi_static"))
        apart = np.abs(explicit.force - other.force) / 1e3
        most = ", ".join(
            f"{apart[other.moved <= to + 1e-9].max():.1f} to {to * 1e3:g} mm" for to in (1.2e-3, 2e-3, PUSH)
        )
        print(f"{explicit.case.name}: the solvers are at most (kN) {most} apart; {apart[-1]:.1f} at the end")


def print_steps() -> None:
    """Print the force by number of steps, without cap, at 1.6 mm."""
    for method, steps in (("quasi_static", 16), ("quasi_static", 64), ("quasi_static", 256), ("explicit", 64)):
        case = Case("softening in tension and shear", SOFT_IN_SHEAR, False, True, method)
        curve = case.solve(steps, 1.6e-3)
        print(f"{method}, {steps} steps to 1.6 mm: {curve.force[-1] / 1e3:.1f} kN")


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--increments", type=int, default=160, help="steps of the push")
    parser.add_argument("--steps", action="store_true", help="also print the force by number of steps")
    parser.add_argument("--no-explicit", action="store_true", help="leave out the explicit solver")
    parser.add_argument("--output", type=Path, default=HERE, help="folder for the pictures")
    options = parser.parse_args()
    options.output.mkdir(parents=True, exist_ok=True)
    print("| joints | bricks | cap | solver | first peak | most | at 4 mm | time |")
    print("|---|---|---|---|---|---|---|---|")
    curves = []
    for case in cases(not options.no_explicit):
        curves.append(case.solve(options.increments))
        print(curves[-1].row(), flush=True)
    print_agreement(curves)
    if options.steps:
        print_steps()
    draw_curves(curves, options.output / "load_displacement.png")
    shown = [c for c in curves if c.case.cap and c.case.bricks_crack and c.case.method == "quasi_static"]
    draw_cracks(shown, options.output / "cracks.png")


if __name__ == "__main__":
    main()
