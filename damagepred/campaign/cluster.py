"""Dask clusters as executors."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from damagepred.errors import InputError


def connect_dask_scheduler(address: str, timeout: float = 10.0) -> Any:
    """Client of a Dask scheduler, by its address (``tcp://192.168.1.2:8786``) or scheduler file (``*.json``)."""
    try:
        from distributed import Client
    except ImportError:
        raise InputError("--scheduler needs the package distributed: pip install 'damagepred[dask]'") from None
    where = {"scheduler_file": address} if address.endswith(".json") else {"address": address}
    try:
        if address.endswith(".json") and not Path(address).is_file():  # Dask would wait for it
            raise FileNotFoundError(f"{address} does not exist")
        client = Client(**where, timeout=timeout, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(
            f"--scheduler {address}: no Dask scheduler answers there ({type(error).__name__}: {error}); give what "
            "`dask scheduler` prints, such as tcp://192.168.1.2:8786, or the path of its scheduler file (*.json)."
        ) from None
    if not client.nthreads():
        client.close()
        raise InputError(f"--scheduler {address}: has no workers yet; start some with `dask worker {address}`.")
    return client
