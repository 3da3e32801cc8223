"""What the cases of the validation share: to run a study, to judge it against observations, and to write a page."""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pandas as pd
import xarray as xr

from damagepred import Study, open_study
from damagepred.arrays import FloatArray
from damagepred.campaign.settings import StudySettings
from damagepred.inputs.input_files import read_toml
from studies.pages import put_in
from studies.validation.scores import cov_interval, coverage, crps, pit

HERE = Path(__file__).resolve().parent


def run_study(settings: StudySettings, folder: Path, samples: int, workers: int) -> xr.Dataset:
    """Run a study, or go on with it."""
    summary = Study(settings).run(folder, samples=samples, workers=workers)
    print(f"{folder.stem}: {summary.done} of {summary.total} walls, {summary.failed} failed", flush=True)
    if summary.interrupted:
        raise SystemExit(130)
    return open_study(folder)


def settings_of(path: Path, **tables: Any) -> StudySettings:
    """Settings of a study file with some of its values changed, by place such as ``scene__solver``."""
    settings = read_toml(path)
    for place, values in tables.items():
        *way, last = place.split("__")
        target = settings
        for step in way:
            target = target.setdefault(step, {})
        target[last] = {**target.get(last, {}), **values} if isinstance(values, dict) else values
    return StudySettings.from_dict(settings)


def judged(quantity: str, unit: str, predicted: FloatArray, observed: FloatArray, blind: bool = True) -> dict[str, Any]:
    """Return what scores say of a prediction: a row of the table over all cases."""
    predicted, observed = predicted[np.isfinite(predicted)], np.atleast_1d(observed)
    row: dict[str, Any] = {
        "quantity": quantity,
        "unit": unit,
        "blind": blind,
        "walls": len(predicted),
        "observations": len(observed),
        "observed_mean": observed.mean(),
        "predicted_mean": predicted.mean(),
        "predicted_5": np.quantile(predicted, 0.05),
        "predicted_95": np.quantile(predicted, 0.95),
        "observed_cov": np.nan,
        "predicted_cov": predicted.std(ddof=1) / abs(predicted.mean()),
        "crps": crps(predicted, observed).mean(),
        "coverage_50": coverage(predicted, observed, 0.5),
        "coverage_90": coverage(predicted, observed, 0.9),
        "pit": " ".join(f"{value:.3f}" for value in pit(predicted, observed)),
    }
    if len(observed) > 2:
        row["observed_cov"] = observed.std(ddof=1) / abs(observed.mean())
        row["observed_cov_low"], row["observed_cov_high"] = cov_interval(row["observed_cov"], len(observed))
    return row


def table(rows: list[dict[str, Any]]) -> str:
    """Return the rows of some predictions as a table of Markdown."""
    lines = [
        "| quantity | seen: mean (number), COV | predicted: mean (walls), 5 to 95 %, COV | within 50, 90 % | CRPS |",
        "|---|---|---|---|---|",
    ]
    for row in rows:
        cov = "" if np.isnan(row["observed_cov"]) else f", {row['observed_cov']:.2f}"
        lines.append(
            f"| {row['quantity']}, {row['unit']}{'' if row['blind'] else ' (updated)'} | "
            f"{row['observed_mean']:.3g} ({row['observations']}){cov} | {row['predicted_mean']:.3g} ({row['walls']}), "
            f"{row['predicted_5']:.3g} to {row['predicted_95']:.3g}, {row['predicted_cov']:.2f} | "
            f"{row['coverage_50']:.2f}, {row['coverage_90']:.2f} | {row['crps']:.3g} |"
        )
    return "\n".join(lines)


def case_main(here: Path, samples: int, run: Callable[[Path, int, int], tuple[list[dict[str, Any]], str]]) -> None:
    """Run a case from the command line: its studies, the table of its page, and its rows for the page over all."""
    parser = argparse.ArgumentParser(description=f"Case {here.name} of the validation.")
    parser.add_argument("--samples", type=int, default=samples)
    parser.add_argument("--workers", type=int, default=2)
    parser.add_argument("--folder", type=Path, default=here / "results")
    asked = parser.parse_args()
    asked.folder.mkdir(parents=True, exist_ok=True)
    rows, more = run(asked.folder, asked.samples, asked.workers)
    text = f"{table(rows) if rows else ''}\n\n{more}".strip()
    print(text)
    if asked.folder == here / "results":
        if rows:
            pd.DataFrame(rows).to_csv(here / "scores.csv", index=False, float_format="%.4g")
        put_in(here / "README.md", text)
