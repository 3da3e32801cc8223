"""The section of a back-analysis in the report of a study."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import xarray as xr

from damagepred.analyses.posterior_tables import UNCERTAIN, posterior_tables
from damagepred.analyses.stored_walls import study_name
from damagepred.archive.files import read_dataset
from damagepred.errors import InputError, nearest
from damagepred.formatting import chance
from damagepred.report.answers import posterior_answer
from damagepred.report.parts import Part, Section, Text, drawing


def back_analysis_section(file: Path, study: Path) -> Section:
    """Section of a back-analysis file (``infer -o``): cautions, odds, movement, further damage, pictures."""
    from damagepred.plotting import draw_back_analysis

    posterior = read_dataset(file)
    if "another_cause_odds" not in posterior:
        raise InputError(
            f"posterior = {file}: is no back-analysis, or an older one; give the file that `damagepred infer -o` wrote."
        )
    names, own = [str(name) for name in posterior["study"].values], study_name(study)
    if own not in names:
        raise InputError(f"posterior = {file}: is of {', '.join(names)}, not of {own}." + nearest(own, names))
    studies = f"{len(names)} {'study' if len(names) == 1 else 'studies'}: {', '.join(names)}"
    intro = f"{posterior.attrs['observations']} observations, compared with the samples of {studies}."
    parts: list[Part] = [Text([posterior_answer(posterior), intro], posterior_cautions(posterior))]
    parts += posterior_tables(posterior)
    caption = "Distribution of the movement under each cause, given the observations."
    if "until" in posterior:
        caption = "Movement over time under the likeliest cause; bars: each visit alone (90 %)."
    if "crack_probability" in posterior:
        caption += " Below, under the likeliest cause: probable cracks, with observed cracks and levels."
    label = "Posterior distribution of the movement, and map of probable cracks"
    parts.append(drawing("posterior", caption, label, draw_back_analysis(posterior)[0]))
    return Section("posterior", "What the observed cracks say", parts)


def posterior_cautions(posterior: xr.Dataset) -> list[str]:
    """Cautions of a back-analysis: resemblance, effective samples, other causes, ends of paths."""
    said, least = [], posterior.attrs["least_resemblance"]
    measure = f"probability of a larger misfit, at least {least:g} is needed"
    if not posterior["resembles"].values.any():
        said.append(
            "NO STORED SAMPLE RESEMBLES THE OBSERVATIONS: the best misfit is "
            f"{float(posterior['least_misfit'].min()):.3g} for {posterior.attrs['observations']} observations, "
            f"resemblance {chance(float(posterior['resemblance'].max()))} ({measure}). "
            f"{_worst_observation(posterior.isel(study=int(np.argmin(posterior['least_misfit'].values))))}"
            "No odds are given. Do not use this posterior; widen the study, or check the survey."
        )
    for name in posterior["study"].values:
        cause = posterior.sel(study=name)
        if not cause["resembles"]:
            if posterior["resembles"].values.any():
                resemblance = f"resemblance {chance(float(cause['resemblance']))} ({measure})"
                worst = _worst_observation(cause).rstrip()
                said.append(
                    f"{name}: no stored sample resembles the observations, {resemblance}; it has no odds. {worst}"
                )
            continue
        if (effective := float(cause["effective_samples"])) < (fewest := posterior.attrs["fewest_effective"]):
            said.append(
                f"{name}: only {effective:.1f} effective samples, fewer than {fewest:g}, so it has no odds; a larger "
                "study, --new-walls 100 or more replays make the posterior surer."
            )
        if advice := str(cause["advice"].values):
            cut = float(cause["movement_cut"])
            where = f"{cut:.0%} of the posterior lies at the end of the paths, which cut the movement's interval there"
            if not cut > UNCERTAIN:
                where = "paths end before the further movements"
            said.append(f"{name}: {where}; damage beyond is unknown. To know it, {advice}.")
    if posterior.sizes.get("visit") == 1:
        said.append("One visit shows no rate: rate and forecast come from the prior of the history alone.")
    if posterior.sizes.get("visit") == 2 and posterior.sizes["kind"] > 1:
        said.append("Two visits do not show if the movement has ended: the rate depends on the prior of the history.")
    if float(posterior["another_cause_odds"]) > 1:
        said.append("A cause without a study is more probable than all studies together.")
    return said


def _worst_observation(cause: xr.Dataset) -> str:
    """Sentence on the observation with the largest misfit in the nearest state; none in older files, or without one."""
    if "misfit_of_observation" not in cause or not np.isfinite(float(cause["least_misfit"])):
        return ""
    misfit = cause["misfit_of_observation"]
    worst = misfit[int(np.argmax(misfit.values))]
    return f"The nearest state misses {worst['observation'].item()} most: {float(worst):.3g} of the misfit. "
