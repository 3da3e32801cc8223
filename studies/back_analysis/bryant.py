"""Back-analysis of the test of Bryant (1993): the posterior of the movement of two walls whose movement is known.

    python studies/back_analysis/bryant.py [--samples 24] [-j 2] [--folder results]

The walls stand on supports and jacks, with the unknowns of the test, and are dished and domed further than in the
test. The same command resumes. It draws the posterior of each wall.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

import matplotlib.pyplot as plt
import numpy as np
import xarray as xr

HERE = Path(__file__).resolve().parent
STUDIES = HERE.parent
sys.path[:0] = [str(STUDIES / "bryant_1993"), str(STUDIES / "validation")]

from cases import bent_before, further, on_jacks, read_case, results_of_the_test  # noqa: E402

from damagepred import infer, plotting  # noqa: E402
from damagepred.analyses.posterior_tables import posterior_tables  # noqa: E402
from damagepred.campaign.settings import StudySettings  # noqa: E402
from damagepred.inputs.input_files import read_toml  # noqa: E402
from damagepred.plotting.sheet import figure_of  # noqa: E402
from damagepred.report.back_analysis import posterior_cautions  # noqa: E402
from damagepred.study import Study  # noqa: E402
from damagepred.uq.observations import CrackObservation, Observations, WindowObservation  # noqa: E402
from studies.pages import put_in  # noqa: E402

LARGEST, INCREMENTS = 12e-3, 12
DPC = 0.15
"""Height of the dpc (m)."""
SEEN = 5e-4
"""Opening of the dpc from which it is taken to be seen, and its standard error (m); neither is reported."""
MARKS = "<!-- written by bryant.py -->", "<!-- end of bryant -->"
WALLS = {"solid": ("dishing", "doming"), "window": ("window_dishing", "window_doming")}


def archive(name: str, folder: Path, samples: int, workers: int) -> Path:
    """Run a wall of the test further than it went."""
    scene = further(on_jacks(read_case(name).scene, bent_before(1e3)))
    movement = replace(scene.movement, central_deflection=LARGEST, increments=INCREMENTS)
    unknowns = read_toml(STUDIES / "validation" / "bryant" / "unknowns.toml")
    settings = StudySettings.from_dict({**unknowns, "scene": replace(scene, movement=movement).to_dict()})
    place = folder / f"{name}.dp"
    summary = Study(settings).run(place, samples, workers)
    if summary.interrupted:
        raise SystemExit(130)
    print(f"{name}: {summary.done} of {summary.total} walls, {summary.failed} failed", flush=True)
    return place


def _dpc(x: float, **seen: float | bool) -> CrackObservation:
    return CrackObservation(x=x, y=DPC, within=0.15, part="dpc", error=SEEN, **seen)


def surveys() -> dict[str, tuple[str, Observations]]:
    """Return what was seen of each wall, and which walls it is compared with."""
    test = results_of_the_test()
    closed = float(test["dishing"]["dpc_closed_length_at_ends"])
    left, right = test["doming"]["dpc_opening_at_ends"]
    sound = CrackObservation(none=True)
    parted = [_dpc(x, wider_than=SEEN) for x in (closed + 0.15, 3.0, 6.0 - closed - 0.15)]
    shut = [_dpc(x, none=True, visible=SEEN) for x in (closed - 0.15, 6.0 - closed + 0.15)]
    change = float(test["window_dishing"]["opening_width_change"])
    return {
        "solid wall, dishing to 8 mm": ("solid", Observations(crack=(sound, *parted, *shut))),
        "solid wall, doming to 7 mm": (
            "solid",
            Observations(
                crack=(sound, _dpc(0.1, width=left), _dpc(5.9, width=right), _dpc(3.0, none=True, visible=SEEN))
            ),
        ),
        "window wall, dishing, perhaps to 8 mm": (
            "window",
            Observations(window=(WindowObservation(opening=1, width_change=change),)),
        ),
    }


def picture(found: xr.Dataset, name: str) -> None:
    """Draw the posterior of a wall, with the deflection of the test."""
    alone = plt.subplots(figsize=(8.0, 4.0), layout="constrained")[1]
    axes = plotting.draw_back_analysis(found, None if "crack_probability" in found else [alone])
    axes[0].axvline(float(name.split()[-2]), color="black", linewidth=1.0)
    said = "in the test, perhaps" if "perhaps" in name else "in the test"
    axes[0].annotate(said, (float(name.split()[-2]), 0.02), (4, 0), textcoords="offset points")
    wall, kind, *_ = name.replace(",", "").replace("wall ", "").split()
    figure_of(axes[0]).savefig(HERE / f"bryant_{wall}_{kind}.png", dpi=100)


def main() -> None:
    """Run the archives, infer, and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=24)
    parser.add_argument("--folder", type=Path, default=HERE / "results" / "bryant")
    parser.add_argument("-j", "--workers", type=int, default=2)
    given = parser.parse_args()
    given.folder.mkdir(parents=True, exist_ok=True)
    stored = {
        wall: [archive(name, given.folder, given.samples, given.workers) for name in names]
        for wall, names in WALLS.items()
    }
    lines = [
        "| wall | studies | odds, one kind against the other | central deflection, 90 % interval (mm) | effective |"
    ]
    lines.append("|---|---|---|---|---|")
    for name, (wall, seen) in surveys().items():
        found = infer(stored[wall], seen, workers=given.workers)
        share = np.bincount(found["study_of_sample"].values, found["posterior"].values.sum(axis=1))
        for (one, moved, _, _, count, _), odds in zip(posterior_tables(found)[0].rows, share / (1.0 - share)):
            lines.append(f"| {name} | {one} | {odds:.3g} | {moved.partition(',')[0]} | {count} |")
        print("\n".join([name, *posterior_cautions(found)]), flush=True)
        picture(found, name)
    print("\n".join(lines))
    if given.folder == HERE / "results" / "bryant":
        put_in(HERE / "README.md", "\n".join(lines), *MARKS)


if __name__ == "__main__":
    main()
