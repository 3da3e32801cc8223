"""One self-contained page for a wall or a study: answer, damage, cautions; inputs in an appendix."""

from damagepred.report.writing import write_report

__all__ = ["write_report"]
