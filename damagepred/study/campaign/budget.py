"""Price of a study, and the time its samples may take, before anything is built."""

from __future__ import annotations

import math
from concurrent.futures import Executor

from damagepred.assembly import Limits, wall_size
from damagepred.errors import InputError, require_number
from damagepred.study.settings import StudySettings

MOST_SAMPLES = 10**9
"""Of a study, whatever its price: as many as a scrambled Sobol sequence has points."""
COPIES = 8
"""Numbers of eight bytes held for each input of a sample while a design is drawn and written."""


def require_affordable(settings: StudySettings, limits: Limits, samples: int | None = None) -> None:
    """Check that one wall of a study, its fields and its design are within limits.

    Parameters
    ----------
    settings : StudySettings
        The study.
    limits : Limits
        What is accepted.
    samples : int, optional
        Number of samples; by default the study's.

    Raises
    ------
    InputError
        If they are not.
    """
    fields = [v.field for v in settings.variables.values() if v.field is not None]
    dense = 0 if all(f.by_course for f in fields) else len(fields)
    for scene in {settings.scene, settings.study.fields_from or settings.scene}:
        wall_size(scene).require(limits, dense)
    count = settings.study.samples if samples is None else samples
    require_number("samples", count, 1, MOST_SAMPLES)
    needed = 8.0 * COPIES * count * (len(settings.variables) + 1)
    if needed > limits.memory:
        raise InputError(
            f"samples = {count}: the design alone would take about {needed / 1e9:.2g} GB of memory, more than "
            f"{limits.memory / 1e9:.2g} GB; --yes, or limits=NO_LIMITS in Python, draws it all the same."
        )


def sample_timeout(timeout: float | None, limits: Limits, executor: Executor | None) -> float | None:
    """Return the time that a sample may take (s), None for no limit.

    Parameters
    ----------
    timeout : float or None
        As asked for; None takes that of the limits, infinite is no limit.
    limits : Limits
        Of the study.
    executor : Executor or None
        That of the caller, which has limits of its own.

    Raises
    ------
    InputError
        If the time is no positive number, or goes with an executor.
    """
    if timeout is not None and timeout != math.inf:
        require_number("timeout", timeout, 0.0, unit="s", open_low=True)
    if executor is not None:
        if not any(callable(getattr(executor, name, None)) for name in ("submit", "get_executor")):
            raise InputError(
                f"executor: is of type {type(executor).__name__}; give a concurrent.futures executor or a Dask client."
            )
        if timeout is not None:
            raise InputError("timeout: is for the local workers; with an executor of your own, let it set the limit.")
        return None
    seconds = limits.time if timeout is None else timeout
    return None if seconds == math.inf else float(seconds)
