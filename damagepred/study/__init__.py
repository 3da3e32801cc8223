"""The campaign: many sampled walls, their workers, failures and folder."""

from damagepred.archive.folder import open_study
from damagepred.study.analyses.function import StudyFunction, as_function
from damagepred.study.study import Progress, RunSummary, Study

__all__ = ["Progress", "RunSummary", "Study", "StudyFunction", "as_function", "open_study"]
