"""Run this study: python studies/guidance/layout/run.py [--samples 16] [--workers 2]."""

import sys
from pathlib import Path

HERE = Path(__file__).resolve().parent
sys.path.insert(0, str(HERE.parent))

from room import run_study  # noqa: E402

if __name__ == "__main__":
    sys.exit(run_study(HERE))
