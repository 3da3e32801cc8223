"""Run the studies of README.md's table, one after the other: python studies/run.py [NAME ...] [--quick].

Complete studies of the present package are left out, interrupted ones resume, results of another package are deleted.
"""

import argparse
import os
import shutil
import subprocess
import sys
import tempfile
import time
from datetime import UTC, datetime
from pathlib import Path

import pandas as pd

from studies.pages import machine, package, version

HERE = Path(__file__).resolve().parent
STORED = ("results", "data.csv", "runs.csv")  # a study would continue these


def studies() -> pd.DataFrame:
    """Table of README.md: study, question, command, minutes on two cores, arguments of the smallest part."""
    lines = (HERE / "README.md").read_text(encoding="utf-8").splitlines()
    rows = [[cell.strip(" `") for cell in line.split("|")[1:-1]] for line in lines if line.startswith("| [")]
    table = pd.DataFrame(rows, columns=["study", "question", "command", "minutes", "quick"])
    table["study"] = table["study"].str.extract(r"\[(.*?)\]")
    return table.astype({"minutes": float}).set_index("study")


def runs() -> pd.DataFrame:
    """Last run of each study: package, version, date, machine, minutes, end."""
    return pd.read_csv(HERE / "runs.csv", dtype=str).set_index("study")


def ended(command: str, minutes: float) -> str:
    """Run a command for three times its minutes at most; return how it ended."""
    paths = os.pathsep.join(filter(None, [str(HERE.parent), os.environ.get("PYTHONPATH")]))
    words, variables = [sys.executable, *command.split()[1:]], os.environ | {"PYTHONPATH": paths}
    try:
        code = subprocess.run(words, cwd=HERE.parent, env=variables, timeout=180 * minutes).returncode
    except subprocess.TimeoutExpired:
        return "stopped"
    return {0: "complete", 3: "complete, failed walls"}.get(code, f"failed ({code})")


def measure(name: str, command: str, minutes: float) -> str:
    """Run a study and record it; return how it ended."""
    table = runs()
    if name not in table.index or table["package"][name] != package():
        for place in (HERE / name / stored for stored in STORED):
            shutil.rmtree(place) if place.is_dir() else place.unlink(missing_ok=True)
    elif table["end"][name].startswith("complete"):
        return table["end"][name]
    row, began = [package(), version(), f"{datetime.now(UTC):%Y-%m-%d}", machine()], time.perf_counter()
    for run in (lambda: "started", lambda: ended(command, minutes)):
        end = run()
        table.loc[name] = [*row, f"{(time.perf_counter() - began) / 60:.1f}", end]
        table.to_csv(HERE / "runs.csv")
    return end


def main() -> int:
    """Read the command line, print the price, run, print how each study ended."""
    known, parser = studies(), argparse.ArgumentParser(description=__doc__)
    parser.add_argument("names", nargs="*", default=list(known.index), metavar="NAME", help=", ".join(known.index))
    parser.add_argument("--quick", action="store_true", help="the smallest part of each; no page changes")
    given, ends = parser.parse_args(), {}
    if wrong := [name for name in given.names if name not in known.index]:
        parser.error(f"no study {', '.join(wrong)}; there are {', '.join(known.index)}")
    print(f"{len(given.names)} studies, {known.minutes[given.names].sum():g} minutes on two cores without --quick")
    for name, command, minutes, quick in known.loc[given.names, ["command", "minutes", "quick"]].itertuples():
        print(f"== {name}: {command}", flush=True)
        with tempfile.TemporaryDirectory() as out:
            small = f"{command} {quick.replace('OUT', out)}"
            ends[name] = ended(small, 5.0) if given.quick else measure(name, command, minutes)
        print(f"== {name}: {ends[name]}", flush=True)
    return int(not all(end.startswith("complete") for end in ends.values()))


if __name__ == "__main__":
    sys.exit(main())
