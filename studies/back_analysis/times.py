"""Time of a posterior from a stored archive of 5000 walls, and with 500 more walls.

    python studies/back_analysis/times.py [--walls 5000] [--more 500]

The archive is synthetic: its widths are drawn, not solved. Replays and new walls are solved, those of a small wall.
The survey has three cracks and one place without.
"""

from __future__ import annotations

import argparse
import json
import sys
import tempfile
import time
from pathlib import Path

HERE = Path(__file__).resolve().parent
ROOT = HERE.parents[1]
sys.path[:0] = [str(ROOT), str(HERE.parent / "validation")]

from judging import write_page  # noqa: E402

from damagepred.analyses.back_analysis import InferenceOptions, infer  # noqa: E402
from damagepred.uq.observations import CrackObservation, Observations  # noqa: E402
from tests.synthetic_studies import synthetic_study  # noqa: E402

MARKS = "<!-- written by times.py -->", "<!-- end of times -->"
SEEN = Observations(
    crack=(
        CrackObservation(width="1 mm"),
        CrackObservation(x=0.2, y=0.2, wider_than="0.1 mm"),
        CrackObservation(x=0.7, y=0.2, narrower_than="5 mm"),
        CrackObservation(x=1.2, y=0.5, none=True, visible="1 mm"),
    )
)


def page_text(result: dict[str, dict[str, float]]) -> str:
    """Return the table of the page."""
    lines = ["| posterior | walls | replayed | elapsed, s | limit, s |", "|---|---|---|---|---|"]
    for (name, one), limit in zip(result.items(), (60, 60, 600)):
        lines.append(f"| {name} | {one['walls']} | {one['replayed']} | {one['elapsed_s']} | {limit} |")
    return "\n".join(lines)


def main() -> None:
    """Build the archive, infer, and print the times."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--walls", type=int, default=5000)
    parser.add_argument("--more", type=int, default=500)
    given = parser.parse_args()
    result = {}
    with tempfile.TemporaryDirectory() as folder:
        house = synthetic_study(Path(folder) / "house.dp", given.walls)
        for name, options in (
            ("first, with replays", InferenceOptions()),
            ("again, replays kept", InferenceOptions()),
            ("with new walls", InferenceOptions(new_walls=given.more, rounds=1, fewest_effective=1e9)),
        ):
            began, processor = time.monotonic(), time.process_time()
            found = infer(house, SEEN, options=options)
            result[name] = {
                "processor_s": round(time.process_time() - processor, 1),
                "elapsed_s": round(time.monotonic() - began, 1),
                "walls": found.sizes["sample"],
                "replayed": int(found["replayed"][0]),
                "effective_samples": round(float(found["effective_samples"][0]), 1),
            }
    print(json.dumps(result, indent=1))
    if (given.walls, given.more) == (5000, 500):
        write_page(HERE / "README.md", page_text(result), MARKS)


if __name__ == "__main__":
    main()
