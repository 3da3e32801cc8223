"""Mutated input: no traceback, no hang, no result that is not finite. See README.md.

Run: python studies/fuzz/run.py files [--count 20000] [--seed 1] [--solved 0.3] [--out FOLDER]
     python studies/fuzz/run.py folders [--count 1000] [--seed 1] [--out FOLDER]

The same command resumes an interrupted run of files.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent


def main() -> int:
    """Run the campaign; return 1 where there are defects."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    kinds = parser.add_subparsers(dest="what", required=True)
    files = kinds.add_parser("files", help="scenes, studies, damage tables and tables of values, mutated")
    files.add_argument("--count", type=int, default=20_000, help="files in all")
    files.add_argument("--seed", type=int, default=1)
    files.add_argument("--solved", type=float, default=0.3, help="share of accepted files that are solved")
    files.add_argument("--out", type=Path, default=HERE, help="folder of log and summary")
    folders = kinds.add_parser("folders", help="study folders and results, damaged")
    folders.add_argument("--count", type=int, default=1000, help="folders in all")
    folders.add_argument("--seed", type=int, default=1)
    folders.add_argument("--out", type=Path, default=HERE, help="folder of the log")
    given = parser.parse_args()
    if given.what == "folders":
        import folders as of_folders

        return of_folders.main(given.count, given.seed, given.out)
    import files as of_files

    return of_files.main(given.count, given.seed, given.out, given.solved)


if __name__ == "__main__":
    sys.exit(main())
