"""The section of a back-analysis in the report of a study."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from damagepred.analyses.posterior_tables import odds_in_words, posterior_tables, sentences
from damagepred.analyses.stored_walls import study_name
from damagepred.archive.files import read_dataset
from damagepred.errors import InputError, nearest
from damagepred.report.parts import Part, Section, Table, Text, drawing
from damagepred.uq.observations import ANOTHER


def back_analysis_section(file: Path, study: Path) -> Section:
    """Section of a back-analysis file (``infer -o``): cautions, odds, movement, further damage, pictures."""
    from damagepred.plotting import draw_back_analysis

    found = read_dataset(file)
    if "another_cause_odds" not in found:
        raise InputError(
            f"posterior = {file}: is no back-analysis, or an older one; give the file that `damagepred infer -o` wrote."
        )
    names, own = [str(name) for name in found["study"].values], study_name(study)
    if own not in names:
        raise InputError(f"posterior = {file}: is of {', '.join(names)}, not of {own}." + nearest(own, names))
    odds = np.append(found["posterior_odds"].values, found["another_cause_odds"].values)
    intro = (
        f"{found.attrs['observations']} observations on the wall, compared with the walls of "
        f"{len(names)} {'study' if len(names) == 1 else 'studies'}: {', '.join(names)}."
    )
    if np.isfinite(odds).any():
        best = int(np.nanargmax(odds))
        intro += f" The likeliest is {[*names, ANOTHER][best]}, odds {odds_in_words(odds[best])}."
    parts: list[Part] = [Text([], sentences(found)), Text([intro])]
    parts += [Table(title, columns, rows) for title, columns, rows in posterior_tables(found)]
    caption = "Distribution of the movement under each cause, given the observations."
    if "crack_probability" in found:
        caption += " Below, under the likeliest cause: where cracks are probable, and what was observed."
    label = "Posterior distribution of the movement, and map of probable cracks"
    parts.append(drawing("posterior", caption, label, draw_back_analysis(found)[0]))
    return Section("posterior", "What the observed cracks say", parts)
