"""The main job: one wall, a study of many, fragility curves, pictures.

    python studies/bryant_window/run.py [--samples 32] [--workers 2] [--output studies/bryant_window/results]

Runs the same commands a user types and prints each. The same call resumes an interrupted one.
"""

from __future__ import annotations

import argparse
import os
import subprocess
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
DATA = HERE.parents[1] / "data"


def main() -> int:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--samples", type=int, default=32, help="walls to sample")
    parser.add_argument("--workers", type=int, default=max(1, min(4, os.cpu_count() or 1)), help="processes")
    parser.add_argument("--output", type=Path, default=HERE / "results", help="folder for archive, table and pictures")
    options = parser.parse_args()
    out = options.output
    out.mkdir(parents=True, exist_ok=True)
    study, folder = DATA / "bryant_study.toml", out / "bryant_study.dp"
    return (
        damagepred("solve", DATA / "bryant_window_dishing_40mm.toml", "-o", out / "wall.nc", "--plot", out / "wall")
        or damagepred("study", study, "-n", options.samples, "-j", options.workers, "-o", folder)
        or damagepred("status", folder)
        or damagepred(
            "fragility",
            folder,
            "-o",
            out / "fragility.nc",
            "--csv",
            out / "fragility.csv",
            "--plot",
            out / "fragility.png",
        )
        or damagepred("plot", folder, "-o", out / "study")
        or damagepred("report", folder, "-o", out / "report.html")
        or damagepred("replay", folder, 0, "--plot", out / "sample_0")
    )


def damagepred(*arguments: object) -> int:
    """Print a command and run it; exit code 3 (some walls failed, and are recorded) does not stop the others."""
    words = [str(a) for a in arguments]
    print("$ damagepred " + " ".join(os.path.relpath(w) if os.sep in w else w for w in words), flush=True)
    code = subprocess.run([sys.executable, "-m", "damagepred", *words], check=False).returncode
    return 0 if code == 3 else code


if __name__ == "__main__":
    sys.exit(main())
