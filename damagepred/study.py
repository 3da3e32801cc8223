"""A Monte Carlo study: the campaign, and the analyses that run campaigns."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any

from damagepred.analyses.function import USUAL, Kept, StudyFunction
from damagepred.analyses.limit_state import Question
from damagepred.analyses.rare_event import RareEvent, rare_event
from damagepred.archive.folder import StudyFolder, open_study
from damagepred.campaign.campaign import Campaign, Progress, RunSummary
from damagepred.campaign.settings import resumed
from damagepred.inputs.arguments import checked

__all__ = ["Progress", "RunSummary", "Study", "StudyFunction", "open_study"]


class Study(Campaign):
    """Monte Carlo study: ``run`` solves its samples; ``function`` and ``rare`` use the same walls in other analyses.

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
        """Study as a plain function: vector of its variables -> xarray.Dataset.

        Parameters
        ----------
        outputs : sequence of str, optional
            Results to return; by default category, crack width and opening of the dpc.
        movement : {"path", "sampled", "both"}, optional
            Increments to return, as in ``[study]``; by default as in the study.
        """
        return StudyFunction(self.settings, USUAL if outputs is None else outputs, movement, self.limits)

    @checked
    def rare(self, category: int, at: float, out: str | Path, *, reach: float = 2.0, **options: Any) -> RareEvent:
        """Probability that a category is reached by a movement, also a very small one, by subset simulation.

        Parameters
        ----------
        category : int
            This category or a worse one.
        at : float
            Movement (m): central deflection, or on a mound the surface's movement.
        out : str or Path
            Folder; the same call resumes an interrupted one.
        reach : float
            Factor on this movement to which walls are solved, to measure their distance from the category.
        options
            samples (a level), level_share, workers, executor, timeout, confidence, on_level; see
            ``damagepred.analyses.rare_event.rare_event``.
        """
        return rare_event(self.settings, Question(category, at, reach), out, **options)

    def _resuming(self, folder: StudyFolder) -> Campaign:
        """Study that a folder continues; alternatives of a search and houses of a portfolio do not mix bricks."""
        folder.require()
        return Campaign(resumed(self.settings, folder.study_text()), self.limits)
