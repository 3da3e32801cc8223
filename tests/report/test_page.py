"""The page as HTML: valid, self-contained, every name once; the drawing that a reader moves."""

import base64
import json
import re
import zlib
from collections import Counter
from pathlib import Path
from typing import Any
from xml.etree import ElementTree as Tree

import html5lib
import numpy as np
import pytest
import xarray as xr

from damagepred.archive.files import write_dataset
from damagepred.plotting.geometry import Faces, ground_profile
from damagepred.report import write_report
from damagepred.report.explorer import LEVELS, explorer
from damagepred.report.parts import Drawing, Page
from damagepred.report.writing import page_html
from tests.synthetic_studies import synthetic_study

HTML = "{http://www.w3.org/1999/xhtml}"
SVG = "{http://www.w3.org/2000/svg}"
OUTLINES = re.compile(r' d="[\w\s.,-]*"')
NAMED_BY = re.compile(r"url\(#([^)]+)\)")


def parsed(text: str) -> Tree.Element:
    """The page as a tree; a parse error of the HTML standard is an error."""
    text = OUTLINES.sub(' d=""', text)  # most of the page, and nothing to get wrong in it
    return html5lib.HTMLParser(strict=True, namespaceHTMLElements=True).parse(text)


def check_page(text: str) -> Tree.Element:
    """Hold a page to what every report must be."""
    root = parsed(text)
    assert root.get("lang") == "en"
    assert root.find(f".//{HTML}title").text
    assert root.find(f".//{HTML}meta[@name='viewport']") is not None
    ids = Counter(e.get("id") for e in root.iter() if e.get("id"))
    assert max(ids.values()) == 1, [name for name, count in ids.items() if count > 1]
    for element in root.iter():
        for key, value in element.attrib.items():
            if key in ("href", "{http://www.w3.org/1999/xlink}href", "src", "data", "action", "poster", "srcset"):
                inside = value.startswith("data:image/png;base64,") and element.tag == f"{SVG}image"
                assert inside or value.startswith("#"), value  # nothing outside
                assert inside or value[1:] in ids, value
            if key in ("aria-labelledby", "aria-describedby"):
                assert value in ids
            for name in NAMED_BY.findall(value):
                assert name in ids, value
            assert not key.startswith("on")
    assert not list(root.iter(f"{HTML}link")) + list(root.iter(f"{HTML}img"))
    for script in root.iter(f"{HTML}script"):
        for outside in ("http:", "https:", "fetch(", "XMLHttpRequest", "import(", "innerHTML", "eval("):
            assert outside not in script.text
    style = "".join(e.text or "" for e in root.iter(f"{HTML}style"))
    assert "url(" not in style
    assert "@import" not in style
    assert "http" not in style
    for drawing in root.iter(f"{SVG}svg"):
        assert drawing.get("role") == "img"
        assert drawing.get("aria-label")
    for figure in root.iter(f"{HTML}figure"):
        assert figure.find(f"{HTML}figcaption").text.strip()
    for table in root.iter(f"{HTML}table"):
        assert table.get("aria-labelledby")
        widths = {sum(int(cell.get("colspan", 1)) for cell in row) for row in table.iter(f"{HTML}tr")}
        assert len(widths) == 1, table.get("aria-labelledby")
    heads = [e.tag.removeprefix(HTML) for e in root.iter() if e.tag in (f"{HTML}h1", f"{HTML}h2", f"{HTML}h3")]
    assert heads[0] == "h1"
    assert heads.count("h1") == 1
    for script in root.findall(f".//{HTML}script"):
        script.text = ""
    shown = "".join(root.find(f"{HTML}body").itertext())
    assert not re.search(r"\bnan\b|\binf\b|None\b|np\.float", shown)
    return root


def test_report_of_a_wall(wall: xr.Dataset, tmp_path: Path) -> None:
    write_dataset(wall, tmp_path / "wall.nc")
    file = write_report(tmp_path / "wall.nc")
    assert file == tmp_path / "wall_report.html"
    text = file.read_text(encoding="utf-8")
    assert len(text) < 5e6
    root = check_page(text)
    sections = [e.get("id") for e in root.iter(f"{HTML}section")]
    assert sections == ["damage", "limits", "caveats", "inputs", "run", "quality", "files"]
    assert [a.get("href") for a in root.find(f".//{HTML}nav").iter(f"{HTML}a")] == [f"#{s}" for s in sections]
    figures = [e.get("id") for e in root.iter(f"{HTML}figure")]
    assert figures == [f"figure-{f}" for f in ("wall", "history", "cracks", "dpc", "footing-gap", "openings")]
    kinds = [e.get("type") for e in root.iter(f"{HTML}script")]
    assert kinds == ["application/json", None]  # one script of its own, and the still drawing
    (moved,) = (e for e in root.iter(f"{HTML}div") if e.get("class") == "explorer")
    assert moved.get("hidden") is not None  # until a script shows it
    linked = [e for e in root.iter(f"{SVG}svg") if e.get("data-from") is not None]
    assert len(linked) == 1
    share = [float(linked[0].get(f"data-{side}")) for side in ("left", "right")]
    assert 0.0 < share[0] < 0.2
    assert 0.75 < share[1] < 1.0
    assert float(linked[0].get("data-to")) == pytest.approx(12.0, rel=0.05)


@pytest.mark.quick_cases
@pytest.mark.parametrize(("failed", "missing"), [((), ()), ((3, 7), range(12, 40))])
def test_report_of_a_study(failed: tuple[int, ...], missing: range, tmp_path: Path) -> None:
    folder = synthetic_study(tmp_path / "house.dp", 40, failed=failed, missing=missing)
    file = write_report(folder, tmp_path / "r.html", replay=False, bootstrap=20)
    root = check_page(file.read_text(encoding="utf-8"))
    sections = [e.get("id") for e in root.iter(f"{HTML}section")]
    assert sections == ["damage", "fragility", "limits", "caveats", "inputs", "run", "quality", "files"]
    figures = [e.get("id") for e in root.iter(f"{HTML}figure")]
    assert figures == ["figure-fragility", "figure-shares", "figure-widths"]
    notes = ["".join(e.itertext()) for e in root.iter(f"{HTML}p") if e.get("class") == "warning"]
    assert len(notes) == bool(failed) + bool(missing) + 1
    assert "the gap along the bed on the footing is of a higher category than the cracks" in notes[-1]
    if missing:
        assert f"unfinished: {len(missing)} of 40 walls have not been run" in notes[0]
    if failed:
        assert f"{len(failed)} of 40 walls failed" in notes[-2]


def unpacked(packed: dict[str, Any]) -> np.ndarray:
    values = np.frombuffer(zlib.decompress(base64.b64decode(packed["data"])), dtype=np.dtype(packed["type"]))
    return values * (packed["largest"] / LEVELS) if "largest" in packed else values


def test_blocks_joints_and_path_are_those_of_the_wall(wall: xr.Dataset) -> None:
    (packed,) = json.loads(explorer({"wall": wall}))["walls"]
    steps, blocks = wall.sizes["increment"], wall.sizes["block"]
    moved = unpacked(packed["moved"]).reshape(steps, blocks, 2)
    expected = np.stack([wall[f"block_displacement_{axis}"].values for axis in "xy"], axis=-1)
    np.testing.assert_allclose(moved, expected, atol=np.abs(expected).max() / LEVELS)
    turned = unpacked(packed["turned"]).reshape(steps, blocks)
    rotation = wall["block_rotation"].values
    np.testing.assert_allclose(turned, rotation, atol=np.abs(rotation).max() / LEVELS)
    faces = Faces.of(wall, -1)
    gap = unpacked(packed["gap"]).reshape(steps, -1)
    crack = np.where(faces.joints.is_masonry, faces.crack, faces.opening)
    np.testing.assert_allclose(gap[-1], crack, atol=np.abs(crack).max() / LEVELS)
    assert gap[-1].max() == pytest.approx(crack.max(), rel=1e-3)
    rise = unpacked(packed["rise"]).reshape(steps, -1)
    ground = ground_profile(wall, -1)[2]
    np.testing.assert_allclose(rise[-1], ground, atol=np.abs(ground).max() / LEVELS)
    corner, first = unpacked(packed["corner"]).reshape(-1, 2), unpacked(packed["first"])
    np.testing.assert_allclose(corner[:, 0], wall["vertex_x"].values, atol=1e-6)
    assert first[-1] == len(corner)
    assert len(first) == blocks + 1
    assert packed["movement"] == pytest.approx(1e3 * wall["central_deflection"].values)


def test_a_title_cannot_end_the_data(wall: xr.Dataset, tmp_path: Path) -> None:
    text = explorer({"</script><b>": wall})
    assert "</script>" not in text
    assert json.loads(text)["walls"][0]["name"] == "</script><b>"


@pytest.mark.parametrize("walls", ["", "{}"])
def test_only_drawings_with_walls_bring_the_script_that_moves_them(walls: str) -> None:
    page = Page("a house", "", [], "", [], [], [], first=[Drawing("a", "", "", "<svg></svg>", walls)])
    assert ("DecompressionStream" in page_html(page)) == bool(walls)
