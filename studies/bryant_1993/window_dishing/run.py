"""One case of the full-scale test alone; see ../run.py.

python studies/bryant_1993/window_dishing/run.py [--no-zones]
"""

import runpy
import sys
from pathlib import Path

STUDY = Path(__file__).resolve().parents[1]

if __name__ == "__main__":
    sys.path.insert(0, str(STUDY))
    runpy.run_path(str(STUDY / "run.py"))["main"](("window_dishing",))
