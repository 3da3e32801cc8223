"""One self-contained page for a wall or a study: answer, damage, cautions; inputs in an appendix."""

from damagepred.report.writing import page_html, report_place, write_report

__all__ = ["page_html", "report_place", "write_report"]
