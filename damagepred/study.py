"""A Monte Carlo study as users have it: the campaign, and the analyses that run campaigns."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from damagepred.analyses.function import USUAL, Kept, StudyFunction, as_function
from damagepred.analyses.limit_state import Question
from damagepred.analyses.rare_event import RareEvent, rare_event
from damagepred.archive.folder import open_study
from damagepred.campaign.campaign import Campaign, Progress, RunSummary
from damagepred.inputs.arguments import checked

__all__ = ["Progress", "RunSummary", "Study", "StudyFunction", "as_function", "open_study"]


class Study(Campaign):
    """A Monte Carlo study: ``run`` solves its samples; ``function`` and ``rare`` run the same walls for other ends.

    Examples
    --------
    >>> import damagepred
    >>> study = damagepred.Study.from_toml("house.toml")
    >>> study.run("again.dp", samples=4).done
    4
    >>> damagepred.open_study("again.dp").sizes["sample"]
    4
    """

    @checked
    def function(self, outputs: Sequence[str] | None = None, movement: Kept | None = None) -> StudyFunction:
        """Return the study as a plain function: vector of its variables -> xarray.Dataset.

        Parameters
        ----------
        outputs : sequence of str, optional
            Results to return; by default category, crack width and opening of the dpc.
        movement : {"path", "sampled", "both"}, optional
            What is returned of the movement; by default what the study keeps.

        Raises
        ------
        InputError
            If there is no such output.
        """
        return StudyFunction(self.settings, USUAL if outputs is None else outputs, movement, self.limits)

    @checked
    def rare(self, category: int, at: float, out: str | Path, *, reach: float = 2.0, **options: Any) -> RareEvent:
        """Estimate the probability that a category is reached by a movement by subset simulation, however small it is.

        Parameters
        ----------
        category : int
            It, or a worse one.
        at : float
            Movement (m): central deflection, or on a mound the surface's movement.
        out : str or Path
            Folder; the same call goes on where an interrupted one stopped.
        reach : float
            Factor on this movement to which walls are solved, to tell how far from the category they are.
        options
            samples (a level), level_share, workers, executor, timeout, confidence, on_level; see
            ``damagepred.analyses.rare_event.rare_event``.

        Returns
        -------
        RareEvent
        """
        return rare_event(self.settings, Question(category, at, reach), out, **options)
