"""Time of a design search over 300 alternatives of a small wall.

    python studies/design/times.py [--alternatives 300] [--workers 2]

Six roughnesses of the dpc, ten roof loads and five kinds of mortar; many are undecided for long.
"""

from __future__ import annotations

import argparse
import tempfile
import time
from pathlib import Path

from damagepred import search_design

LIMIT = 1800  # s
STUDY = """
[study]
samples = 64
seed = 1
[scene.wall]
length = "3.0 m"
height = "1.2 m"
block_length = "0.5 m"
block_height = "0.2 m"
[scene.dpc]
course = 1
[scene.movement]
central_deflection = "8 mm"
increments = 8
[variables."joint.tensile_strength"]
distribution = "lognormal"
mean = "0.2 MPa"
cov = 0.4
field = {}
"""
TARGET = """
study = "wall.toml"
[target]
category = 1
probability = 0.3
at = "5 mm"
first = 16
most = 64
"""


def choices(alternatives: int) -> str:
    """Return the file of the choices, whose product has about as many alternatives."""
    loads = max(1, round(alternatives / 30))
    lines = [TARGET]
    for name, count, key, unit in (
        ("dpc", 6, "scene.dpc.friction = {}", 0.1),
        ("mortar", 5, "scene.joint.cohesion = {}", 1e5),
        ("roof", loads, "scene.loads.roof = {}", 500.0),
    ):
        lines.append(f'[[choice]]\nname = "{name}"')
        for i in range(1, count + 1):
            given = key.format(i * unit)
            lines.append(f'[[choice.option]]\nname = "{name} {i}"\ncost = {10 * i}\n{given}')
    return "\n".join(lines)


def main() -> None:
    """Search and print the time."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--alternatives", type=int, default=300)
    parser.add_argument("--workers", type=int, default=2)
    given = parser.parse_args()
    with tempfile.TemporaryDirectory() as folder:
        Path(folder, "wall.toml").write_text(STUDY)
        Path(folder, "choices.toml").write_text(choices(given.alternatives))
        began = time.monotonic()
        found = search_design(
            Path(folder, "choices.toml"),
            Path(folder, "choices.design"),
            workers=given.workers,
            on_round=lambda size, count: print(
                f"{count} alternatives, {size} samples each, {time.monotonic() - began:.0f} s", flush=True
            ),
        )
        seconds = time.monotonic() - began
    row = f"| {found.sizes['alternative']} | {int(found['samples'].sum())} | {seconds:.0f} | {LIMIT} |"
    print("\n".join(("| alternatives | walls | elapsed, s | limit, s |", "|---|---|---|---|", row)))


if __name__ == "__main__":
    main()
