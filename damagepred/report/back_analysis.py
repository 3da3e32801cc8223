"""The section of a back-analysis in the report of a study."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from damagepred.archive.files import read_dataset
from damagepred.errors import InputError, nearest
from damagepred.report.parts import Part, Section, Table, Text, drawing
from damagepred.study.analyses.posterior_tables import posterior_tables, sentences
from damagepred.study.analyses.stored_walls import study_name


def back_analysis_section(file: Path, study: Path) -> Section:
    """Return what the observed cracks say of movement and cause: cautions, odds, movement, further damage, pictures.

    Parameters
    ----------
    file : Path
        Of a back-analysis, as ``damagepred infer -o`` writes it.
    study : Path
        Folder of the study that the report is of.

    Raises
    ------
    InputError
        If it is no back-analysis, or one without this study.
    """
    from damagepred.plotting import draw_back_analysis

    found = read_dataset(file)
    if "movement_measure" not in found:
        raise InputError(
            f"posterior = {file}: is no back-analysis, or an older one; give the file that `damagepred infer -o` wrote."
        )
    names, own = [str(name) for name in found["study"].values], study_name(study)
    if own not in names:
        raise InputError(f"posterior = {file}: is of {', '.join(names)}, not of {own}." + nearest(own, names))
    likeliest = found.isel(study=int(np.argmax(found["cause_posterior"].values)))
    intro = (
        f"{found.attrs['observations']} observations on the wall, compared with the walls of "
        f"{len(names)} {'study' if len(names) == 1 else 'studies'}: {', '.join(names)}."
    )
    if len(names) > 1:
        intro += (
            f" The likeliest is {likeliest['study'].item()}, with a probability of "
            f"{float(likeliest['cause_posterior']):.2f}. Causes without a study have none."
        )
    parts: list[Part] = [Text([intro], sentences(found))]
    parts += [Table(title, columns, rows) for title, columns, rows in posterior_tables(found)]
    caption = "Distribution of the movement under each cause, given the observations."
    if "crack_probability" in found:
        caption += " Below, under the likeliest cause: where cracks are probable, and what was observed."
    label = "Posterior distribution of the movement, and map of probable cracks"
    parts.append(drawing("posterior", caption, label, draw_back_analysis(found)[0]))
    return Section("posterior", "What the observed cracks say", parts)
