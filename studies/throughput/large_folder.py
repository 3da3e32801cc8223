"""Time to list, resume and read a folder of many walls, made of copies of one solved wall.

Run: python studies/throughput/large_folder.py [--walls 100000]
"""

from __future__ import annotations

import argparse
import sys
import tempfile
import time
from collections.abc import Callable
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).resolve().parent))
from run import solid_wall_study

from damagepred.archive.digest import signature
from damagepred.archive.folder import StudyFolder
from damagepred.archive.parts import joined, read_part, write_part
from damagepred.campaign.dispatch import DispatchOptions
from damagepred.campaign.status import study_status
from damagepred.study import Study


def timed(what: str, do: Callable[[], object]) -> None:
    """Print the time of a block of code."""
    began = time.perf_counter()
    do()
    print(f"{what}: {time.perf_counter() - began:.2f} s", flush=True)


def share(files: list[Path], read: Callable[[Path], object], repetitions: int = 7) -> float:
    """Return the share of checksums in the time of reading files; both times are the shortest of some repetitions."""

    def shortest(do: Callable[[Path], object]) -> float:
        times = []
        for _ in range(repetitions):
            began = time.perf_counter()
            for file in files:
                do(file)
            times.append(time.perf_counter() - began)
        return min(times)

    return shortest(signature) / shortest(read)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--walls", type=int, default=100_000, help="how many (100000)")
    options = parser.parse_args()
    study = Study(solid_wall_study(options.walls))
    with tempfile.TemporaryDirectory() as place:
        folder = StudyFolder(Path(place) / "large.dp")
        study.run(folder.path, samples=1)
        (first,) = folder.part_files()
        row = read_part(first)
        each = max(1, options.walls // DispatchOptions.most_parts)
        timed(f"drawing and writing the design of {options.walls} walls", lambda: study._prepare(folder, options.walls))
        began = time.perf_counter()
        files = 0
        for start in range(1, options.walls - each, each):
            rows = joined([row] * each)
            rows["sample"].values[:] = np.arange(start, start + each)
            write_part(folder.part_file(start, start + each - 1), rows, folder.study_hash)
            files += 1
        print(f"writing {files} parts of {each} walls: {1e3 * (time.perf_counter() - began) / files:.1f} ms each")
        timed("listing what is done", folder.finished)
        timed("status, nothing consolidated", lambda: study_status(folder.path))
        timed("consolidating", folder.consolidate)
        timed("status, all consolidated", lambda: study_status(folder.path))
        timed("reading all", folder.results)
        parts = [f for f, _ in zip(folder.part_files(), range(2000))]
        print(f"checksums: {share(parts, read_part):.1%} of reading parts, ", end="")
        print(f"{share([folder.results_file], lambda _: folder.results()):.1%} of reading results.nc")
        size = sum(f.stat().st_size for f in folder.parts.iterdir())
        print(
            f"parts {size / options.walls:.0f}, results.nc {folder.results_file.stat().st_size / options.walls:.0f} "
            f"bytes a wall"
        )


if __name__ == "__main__":
    main()
