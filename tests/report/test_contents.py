"""Contents of reports, compared with known values."""

import tomllib
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

from damagepred.archive.folder import StudyFolder, open_study
from damagepred.campaign.settings import StudySettings, read_frozen
from damagepred.formatting import length
from damagepred.one_wall.solve import solve
from damagepred.report.caveats import model_caveats, study_caveats
from damagepred.report.inputs import field_source, place_in_words, sources_of_variable, unsure
from damagepred.report.limits import BEYOND, _counted, study_limits, wall_limits
from damagepred.report.study import study_page, typical_and_worst
from damagepred.report.wall import wall_page
from damagepred.results.tables import Table
from damagepred.scene import Scene
from damagepred.uq.estimate import Estimate
from damagepred.uq.exceedance import Exceedance
from tests.synthetic_studies import synthetic_study


def table(section: object, begins: str) -> Table:
    return next(p for p in section.parts if isinstance(p, Table) and p.caption.startswith(begins))


def test_sources_of_variables_tell_mean_and_scatter_apart(data_folder: Path) -> None:
    settings = StudySettings.from_toml(data_folder / "bryant_study.toml")
    mean, scatter = sources_of_variable("joint.tensile_strength", settings.variables["joint.tensile_strength"])
    assert (mean.confidence, scatter.confidence) == ("reported", "assumed")
    assert "Zhuge" in mean.name
    (given,) = sources_of_variable("movement.central_deflection", settings.variables["movement.central_deflection"])
    assert str(given) == "as given"
    text = (data_folder / "bryant_study.toml").read_text().replace("cov = 0.30", "cov = 0.31")
    content = tomllib.loads(text)
    content["scene"] = Scene.from_toml(data_folder / content["scene"]).to_dict()
    changed = StudySettings.from_dict(content).variables["joint.tensile_strength"]
    mean, scatter = sources_of_variable("joint.tensile_strength", changed)
    assert mean.confidence == "reported"
    assert str(scatter) == "cov: as given"
    normal = replace(changed, distribution="normal")
    assert [str(s) for s in sources_of_variable("joint.tensile_strength", normal)] == ["as given"]
    assert str(sources_of_variable("joint.tensile_strength", replace(changed, mean="0.4 MPa"))[0]) == "mean: as given"
    assert str(field_source("joint.tensile_strength", 0.41)) == "as given"
    assert field_source("joint.tensile_strength", 0.4).confidence == "assumed"
    percent = replace(settings.variables["joint.tensile_strength"], cov="30 %")
    assert [s.confidence for s in sources_of_variable("joint.tensile_strength", percent)] == ["reported", "assumed"]
    own = replace(changed, source="our own tests")
    assert [str(s) for s in sources_of_variable("joint.tensile_strength", own)] == ["our own tests"]
    assert "mortar joints: tensile strength" in unsure(settings)
    assert "movement: central deflection" not in unsure(settings)


def test_typical_is_the_median_wall_at_the_movement_asked_for(tmp_path: Path) -> None:
    ds = open_study(synthetic_study(tmp_path / "house.dp", 41, failed=(3,)))
    good = [i for i in range(41) if i != 3]
    category, movement = ds["damage_category"].values, ds["central_deflection"].values
    reached = np.array([m[c >= 2][0] if (c >= 2).any() else np.inf for c, m in zip(category, movement)])
    width = ds["crack_width_max"].values
    at = 2.5e-3
    there = np.array([np.interp(at, movement[i], width[i]) for i in good])
    for chosen, values in ((typical_and_worst(ds, at), there), (typical_and_worst(ds), np.nanmax(width[good], axis=1))):
        assert chosen.worst == good[int(np.argmin(reached[good]))]
        own = values[good.index(chosen.typical)]
        assert (values < own).sum() == 19
        assert (values > own).sum() == 20
        assert length(own) in chosen.why_typical
    assert "at a central deflection of 2.5 mm is the median of all samples" in typical_and_worst(ds, at).why_typical
    # walls that fell before count as wider; the others are left out where they were not followed as far
    ds["status"].values[good[:21]] = 1
    ds["crack_width_max"].values[good[:21], 3:] = np.nan
    fallen = typical_and_worst(ds, at=0.9 * np.nanmax(movement))
    assert fallen.typical in good[:21]
    assert "it fell, or reached the worst category, at" in fallen.why_typical
    # of two walls that fell, the earlier counts as wider
    followed = np.fmax.reduce(np.where(np.isfinite(ds["crack_width_max"].values), movement, np.nan), axis=1)
    order = sorted(good, key=lambda k: (k in good[:21], -followed[k]))
    ended_early = [k for k in good[21:] if followed[k] < 0.9 * np.nanmax(movement) * (1 - 1e-9)]
    ranked = [k for k in order if k not in ended_early]
    assert followed[fallen.typical] == followed[ranked[(len(ranked) - 1) // 2]]


def test_a_limit_that_few_walls_reached_has_no_probability() -> None:
    """2 of 32 walls, both damaged, bent as far: their share is no probability of damage."""
    estimate = Estimate(1.0, 0.1, 0.3, 1.0, 0.9, 32, 32.0)
    assert _counted(Exceedance(estimate, 0, 1.0, 1.0, 30)) == BEYOND
    assert _counted(Exceedance(estimate, 0, 1.0, 1.0, 10)).startswith("1.00")


def test_a_wall_at_a_limit_is_that_of_the_first_increment_beyond_it(wall: xr.Dataset) -> None:
    """AS 2870 Table 4.1 at 2.4 m: full masonry L/2000 is 1.2 mm, reached by the first of four increments to 12 mm."""
    section = wall_limits(wall)
    rows = {row[0]: row[1:] for row in table(section, "This wall at the design").rows}
    limit, here, category, width = rows["full masonry"]
    assert (limit, here) == ("L/2000, 10 mm", "1.2 mm")
    assert category.startswith(str(int(wall["damage_category"][1])))
    assert width == length(float(wall["crack_width_max"][1]))


def test_what_varies_is_named_and_limits_without_entries_are_left_out(tmp_path: Path) -> None:
    folder = StudyFolder(synthetic_study(tmp_path / "house.dp", 30))
    page, settings = study_page(folder, "today", replay=False, bootstrap=10), read_frozen(folder.study_text())
    assert page.facts == [
        ("Walls", f"30 solved of 30; uncertain: {', '.join(map(place_in_words, settings.variables))}"),
        ("Categories", "AS 2870-2011 Table C1, by the widest crack, the opening of one joint"),
    ]
    ds = folder.results()
    ds.attrs["span"] = 1e3
    ds["damage_category"][:] = 0
    ds["central_deflection"][:] *= 1e-3
    assert study_limits(ds) is None


def caveats(scene: dict) -> str:
    return " ".join(model_caveats(Scene.from_dict(scene), ()))


@pytest.mark.parametrize(
    ("words", "said", "not_said"),
    [
        ("Displacements are small, and nothing swings", {}, {"dynamics": {}}),
        ("no creep", {}, {"creep": {}}),
        ("no shrinkage", {}, {"strain": {"growth": 1e-4}}),
        ("a creep coefficient of 1", {"creep": {}}, {"creep": {"coefficient": 0.7}}),
        (
            "a time constant of growth of 1 years",
            {"strain": {"growth": 1e-4}, "movement": {"seasons": {"years": 1}}},
            {"strain": {"growth": 1e-4, "growth_time": 2}, "movement": {"seasons": {"years": 1}}},
        ),
        ("Bricks neither crack nor crush", {}, {"solver": {"method": "explicit", "blocks": "deformable"}}),
        (
            "Bricks neither crack nor crush",
            {},
            {"dpc": {}, "solver": {"method": "explicit", "above_dpc": "deformable"}},
        ),
        ("Bonds break at once", {}, {"joint": {"fracture_energy": 5.0, "shear_fracture_energy": 50.0}}),
        ("keep their cohesion (Eq. 4", {}, {"joint": {"brittle_shear": True}}),
        ("at the first slip", {"joint": {"brittle_shear": True}}, {}),
        (
            "with 125 N/m in mode II",
            {"material": "clay brick, Dutch, shear panels"},
            {"joint": {"fracture_energy": 5.0}},
        ),
        ("follows a given form", {}, {"movement": {"shape": "jacks"}}),
        ("The footing is linear elastic", {"movement": {"shape": "jacks"}}, {}),
        (
            "The footing is linear elastic",
            {"movement": {"shape": "jacks"}},
            {"movement": {"shape": "jacks"}, "footing": {"concrete": {}}},
        ),
        ("of the wall above the damp-proof course", {"dpc": {}}, {}),
        ("compliance of the joints counts twice", {}, {"block": {"elastic_modulus": 12e9}}),
        (
            "compliance of the joints counts twice",
            {"joint": {"normal_stiffness": 0.99e11}},
            {"joint": {"normal_stiffness": 1e11}},
        ),
    ],
)
def test_what_a_model_leaves_out_is_said_where_it_does(words: str, said: dict, not_said: dict) -> None:
    assert words in caveats(said)
    assert words not in caveats(not_said)


def test_what_must_be_known_of_a_study_is_counted(tmp_path: Path) -> None:
    """Its curves, made up: one reached by few, one crossed by an extrapolated median; walls cut short or at a limit."""
    ds = open_study(synthetic_study(tmp_path / "house.dp", 5))
    ds["apex_limited"] = "sample", np.array([2.0, -1.0, 5.0, 0.0, 4.0])
    ds["limit_deflection"] = "sample", np.array([1e-3, np.nan, 2e-3, np.nan, np.nan])
    settings = read_frozen(StudyFolder(tmp_path / "house.dp").study_text())
    curves = xr.Dataset(
        (
            {"reached": ("category", [11, 4, 0]), "not_reached": ("category", [3, 9, 14])}
            | {"p_value": ("category", [0.5, 0.04, np.nan]), "median": ("category", [2e-3, 7.5e-3, np.nan])}
            | {"distance": ("category", [0.1, 0.2, np.nan]), "fit_note": ("category", ["", "", ""])}
        ),
        {"category": [1, 2, 3]},
        {"samples_failed": 6, "curves_cross": 1, "intensity_measure": "central_deflection"},
    )

    def said(curves: xr.Dataset) -> list[str]:
        (text,) = study_caveats(ds, curves, settings, 6e-3).parts
        return [line for line in text.items if line not in model_caveats(settings.scene, settings.variables)]

    known = said(curves)
    for words in (
        "6 failed walls count in the curves",
        "Category 2 was not reached by 9 of 13 walls:",
        "The curve of category 2 is doubtful: of walls that follow such a curve, a share of 0.040 lies as far",
        "The median of category 2, 7.5 mm, lies beyond 6 mm, to which all walls were moved",
        "The curves of two categories, fitted apart, cross",
        "In a sample, 2.75 joints on average have a sampled tensile strength beyond",
        "2 walls ended before the full movement",
    ):
        assert sum(line.startswith(words) for line in known) == 1, words
    assert not any("ategory 1" in line for line in known)
    fewer = said(curves.assign(median=curves["median"] / 7.5 * 6, p_value=curves["p_value"] * 0 + 0.05).drop_attrs())
    assert len(fewer) == len(known) - 4  # at their limits none of these is said; the count of category 2 still is
    ds["apex_limited"] *= 0
    ds["limit_deflection"] *= np.nan
    assert len(said(curves)) == len(known) - 2


def test_what_the_file_gives_is_told_from_defaults_of_the_same_value(tmp_path: Path) -> None:
    thickness = Scene().wall.thickness
    (tmp_path / "wall.toml").write_text(
        f'[wall]\nlength = "0.96 m"\nheight = "0.3 m"\nthickness = {thickness}\n[joint]\nfriction = 0.75\n'
        '[movement]\ncentral_deflection = "1 mm"\nincrements = 1\n',
        encoding="utf-8",
    )
    scene = Scene.from_toml(tmp_path / "wall.toml")
    ds = solve(scene)
    rows = {(row[0], group): row[3] for row, group in _input_rows(wall_page(ds, "wall.nc", "today").appendix[0])}
    assert rows["thickness", "Wall"] == "as given"
    assert rows["block length", "Wall"] == "default"
    assert rows["friction", "Mortar joints"] == "as given, the value of Zhuge et al., Table 2 (reported)"
    assert rows["cohesion", "Mortar joints"] == "default, Zhuge et al., Table 2 (reported)"
    assert rows["residual cohesion", "Mortar joints"] == "default (assumed)"
    # a scene made in Python does not know: values are compared, as in archives of older versions
    ds = solve(replace(scene, title="the same"))
    rows = {(row[0], group): row[3] for row, group in _input_rows(wall_page(ds, "wall.nc", "today").appendix[0])}
    assert rows["thickness", "Wall"] == "default"


def _input_rows(section: object) -> list[tuple[list[str], str]]:
    wall = table(section, "The wall")
    return list(zip(wall.rows, wall.groups))
