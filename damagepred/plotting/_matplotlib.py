"""Import of matplotlib where MPLBACKEND names a backend that is not installed, such as a notebook's: none is needed."""

import contextlib
import os
import sys

if "matplotlib" not in sys.modules:
    backend = os.environ.pop("MPLBACKEND", "")
    try:
        import matplotlib

        with contextlib.suppress(ValueError):
            matplotlib.rcParams.update({"backend": backend} if backend else {})
    finally:
        if backend:
            os.environ["MPLBACKEND"] = backend
