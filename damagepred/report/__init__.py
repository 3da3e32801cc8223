"""One self-contained page for a wall or a study, to be put in a file.

parts      sections, tables, figures
words      numbers with the units engineers write
summary    a sentence for each category, and the most influential input
inputs     the scene and its variables as tables, with where each value comes from
sources    shipped values and their sources
quality    how well the equations are solved
cracks     the cracks of one wall
limits     movement allowed by a code, and probability of damage there
caveats    limits of the results
wall       the page of one wall
study      the page of a study
page       from sections to HTML
"""

from damagepred.report.page import page_html
from damagepred.report.writing import report_place, write_report

__all__ = ["page_html", "report_place", "write_report"]
