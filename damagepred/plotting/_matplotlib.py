"""Import of matplotlib without the backend of MPLBACKEND, which may be a notebook's that is not installed."""

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
