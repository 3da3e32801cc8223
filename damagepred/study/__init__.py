"""The campaign: many sampled walls, their workers, failures and folder."""

from damagepred.archive.folder import open_study
from damagepred.study.study import Progress, RunSummary, Study

__all__ = ["Progress", "RunSummary", "Study", "open_study"]
