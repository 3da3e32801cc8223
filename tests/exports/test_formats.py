"""What exported files must look like; that the programs themselves read them so is shown by studies/exports/run.py."""

import json
from pathlib import Path
from xml.etree import ElementTree as Tree

import numpy as np
import pandas as pd
import pytest
import xarray as xr
from scipy import stats

from damagepred.errors import InputError, StudyError
from damagepred.exports.frames import curves_frame
from damagepred.exports.programs import export_curves, export_place, openquake_xml, pelicun_config, pelicun_frame
from tests.exports.conftest import curves_of

NRML = "{http://openquake.org/xmlns/nrml/0.5}"


def test_pelicun_has_a_row_with_its_columns_and_the_parameters(ratios: xr.Dataset, tmp_path: Path) -> None:
    table, options = export_curves(ratios, "pelicun", tmp_path / "curves.nc")
    assert (table.name, options.name) == ("curves_pelicun.csv", "curves_pelicun.json")
    frame = pd.read_csv(table, float_precision="round_trip")
    assert len(frame) == 1
    row = frame.iloc[0]
    assert "; ".join(frame.columns[:6]) == "ID; Incomplete; Demand-Type; Demand-Unit; Demand-Offset; Demand-Directional"
    # 1: with 0 pelicun multiplies the demand by 1.2
    assert (row["Incomplete"], row["Demand-Offset"], row["Demand-Directional"]) == (0, 0, 1)
    assert row["Demand-Unit"] == "unitless"
    for number, median in enumerate((1 / 900, 1 / 500, 1 / 320, 1 / 220), start=1):
        assert row[f"LS{number}-Family"] == "lognormal"
        assert row[f"LS{number}-Theta_0"] == median  # to the last digit
        assert row[f"LS{number}-Theta_1"] == 0.42
    config = json.loads(options.read_text())
    assert config == {"CustomDemandTypes": {row["Demand-Type"]: {"Acronym": "DFR", "UnitType": "unitless"}}}


def test_exports_name_the_ground_that_moves() -> None:
    """As axes do: a tree's movement is no y_s of a site."""
    for mound, words in (("tree", "ground movement at the tree"), ("walsh", "surface movement")):
        curves = curves_of([0.02, 0.04], [0.4] * 2, "surface_movement")
        curves.attrs["scene"] = f"[mound]\nshape = '{mound}'\n[movement]\nshape = 'mound'"
        assert pelicun_frame(curves)["Demand-Type"].item() == words.title()
        assert list(pelicun_config(curves)["CustomDemandTypes"]) == [words.title()]
        assert f"PGD stands for the {words} (cm)" in openquake_xml(curves)


def test_a_measure_pelicun_cannot_be_told_of_is_refused(ratios: xr.Dataset) -> None:
    with pytest.raises(InputError, match="intensity_measure = 'curvature': exports for pelicun take deflection_ratio"):
        pelicun_frame(ratios.assign_attrs(intensity_measure="curvature"))


def _function(xml: str) -> Tree.Element:
    root = Tree.fromstring(xml)
    assert root.tag == f"{NRML}nrml"
    (model,) = root
    assert model.tag == f"{NRML}fragilityModel"
    assert set(model.attrib) == {"id", "assetCategory", "lossCategory"}
    description, states, function = model  # in this order
    assert description.tag == f"{NRML}description"
    assert description.text
    assert states.tag == f"{NRML}limitStates"
    assert function.tag == f"{NRML}fragilityFunction"
    assert [node.get("ls") for node in function[1:]] == states.text.split()
    imls = function[0]
    assert imls.tag == f"{NRML}imls"
    assert imls.get("imt") == "PGD"
    return function


def test_openquake_continuous_has_mean_and_deviation_of_the_capacity_in_cm(deflections: xr.Dataset) -> None:
    function = _function(openquake_xml(deflections))
    assert (function.get("format"), function.get("shape")) == ("continuous", "logncdf")
    for node, median in zip(function[1:], (0.65, 1.2, 1.85)):
        capacity = stats.lognorm(0.35, scale=median)
        assert node.tag == f"{NRML}params"
        assert float(node.get("mean")) == pytest.approx(capacity.mean(), rel=1e-11)
        assert float(node.get("stddev")) == pytest.approx(capacity.std(), rel=1e-11)
    low, high = (float(function[0].get(name)) for name in ("minIML", "maxIML"))
    assert function[0].get("noDamageLimit") == function[0].get("minIML")
    assert stats.lognorm(0.35, scale=0.65).cdf(low) == pytest.approx(1e-6, rel=1e-4)
    assert stats.lognorm(0.35, scale=1.85).sf(high) == pytest.approx(1e-6, rel=1e-4)


def test_openquake_discrete_has_the_probability_of_each_level(ratios: xr.Dataset) -> None:
    function = _function(openquake_xml(ratios, discrete=True))
    assert function.get("format") == "discrete"
    levels = np.array(function[0].text.split(), dtype=float)
    assert (np.diff(levels) > 0).all()
    for node, median in zip(function[1:], (1 / 900, 1 / 500, 1 / 320, 1 / 220)):
        assert node.tag == f"{NRML}poes"
        told = np.array(node.text.split(), dtype=float)
        assert told == pytest.approx(stats.lognorm(0.42, scale=median).cdf(levels), abs=1e-8)


def test_openquake_says_what_pgd_stands_for(deflections: xr.Dataset) -> None:
    xml = openquake_xml(deflections)
    assert "PGD stands for the central deflection (cm)" in xml
    assert "moved to 2.775 cm at most: beyond that the curves are extrapolated" in xml


@pytest.mark.parametrize(("kind", "form"), [("openquake", "continuous"), ("openquake-discrete", "discrete")])
def test_a_file_for_openquake_has_the_form_asked_for(kind: str, form: str, deflections: xr.Dataset, tmp_path: Path):
    (file,) = export_curves(deflections, kind, tmp_path / "curves.nc")
    assert _function(file.read_text(encoding="utf-8")).get("format") == form


@pytest.mark.parametrize("kind", ["pelicun", "openquake", "openquake-discrete"])
def test_a_category_without_a_curve_is_refused_and_can_be_left_out(kind: str, tmp_path: Path) -> None:
    curves = curves_of([0.002, 0.004, np.nan], [0.3, 0.3, np.nan])
    with pytest.raises(InputError, match=r"category 3: never reached\. Export the others alone \(--categories 1,2\)"):
        export_curves(curves, kind, tmp_path / "house.dp")
    assert list(tmp_path.iterdir()) == []
    files = export_curves(curves, kind, tmp_path / "house.dp", categories=[1, 2])
    text = files[0].read_text()
    assert files[0].parent == tmp_path
    assert "moderate" not in text
    assert "LS3" not in text


def test_no_curve_at_all_says_what_to_do() -> None:
    with pytest.raises(InputError, match=r"category 1: never reached\. Take more samples, or a larger movement"):
        pelicun_frame(curves_of([np.nan], [np.nan]).assign_coords(intensity=np.linspace(0, 1, 31)))


@pytest.mark.parametrize("kind", ["pelicun", "openquake"])
def test_curves_that_cross_are_refused_with_the_remedy(kind: str, tmp_path: Path) -> None:
    # cross where ln(x/0.002)/0.6 = ln(x/0.003)/0.3, that is at 0.0045, probability Phi(ln(2.25)/0.6) = 0.91
    crossing = curves_of([0.002, 0.003], [0.6, 0.3])
    with pytest.raises(InputError, match=r"categories 1 and 2 cross at 0\.0045, where both are 0\.91.*--model common"):
        export_curves(crossing, kind, tmp_path / "curves.nc")
    in_mm = curves_of([0.002, 0.003], [0.6, 0.3], "central_deflection")
    with pytest.raises(InputError, match=r"cross at 4\.5 mm, where both are 0\.91"):
        export_curves(in_mm, kind, tmp_path / "curves.nc")
    swapped = curves_of([0.003, 0.002], [0.3, 0.3])
    with pytest.raises(InputError, match="categories 1 and 2 cross"):
        export_curves(swapped, kind, tmp_path / "curves.nc")


def test_empirical_curves_have_no_parameters_to_export(ratios: xr.Dataset) -> None:
    with pytest.raises(InputError, match="model = 'empirical': has no medians"):
        pelicun_frame(ratios.assign_attrs(model="empirical"))


def test_unknown_categories_formats_and_datasets_are_named(ratios: xr.Dataset, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"categories = \[7\]: the curves are of the categories 1,2,3,4"):
        pelicun_frame(ratios, categories=[1, 7])
    with pytest.raises(InputError, match=r"format = 'pelican': exports are .* Did you mean 'pelicun'"):
        export_place("pelican", tmp_path / "a.nc")
    with pytest.raises(InputError, match="has no variable 'median'"):
        pelicun_frame(xr.Dataset())
    with pytest.raises(StudyError, match="its folder does not exist"):
        export_curves(ratios, "openquake", tmp_path / "nowhere" / "a.nc")


def test_frames_of_curves_hold_what_the_dataset_holds(ratios: xr.Dataset) -> None:
    points = curves_frame(ratios)
    assert points.index.names == ["category", "intensity"]
    assert "; ".join(list(points.columns)) == (
        "category_name; fit_status; probability; probability_lower; probability_upper; empirical"
    )
    assert np.array_equal(points["probability"].to_numpy().reshape(4, -1), ratios["probability"].values)
