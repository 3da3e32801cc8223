"""Reports in a real browser: on a phone, on a screen, on paper. Needs Chromium and the package playwright."""

import re
import shutil
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import pytest
import xarray as xr

from damagepred.archive.files import write_dataset
from damagepred.report import write_report
from tests.synthetic_studies import synthetic_study

pytestmark = pytest.mark.slow

PROGRAMS = ("chromium", "chromium-browser", "google-chrome")
QUIET = (
    "--no-sandbox",
    "--disable-gpu",
    "--disable-quic",
    "--no-first-run",
    "--disable-background-networking",
    "--disable-component-update",
    "--disable-sync",
)


@pytest.fixture(scope="module")
def browser() -> Iterator[Any]:
    program = next((found for name in PROGRAMS if (found := shutil.which(name))), None)
    if program is None:
        pytest.skip(f"no browser here: none of {', '.join(PROGRAMS)}")
    playwright = pytest.importorskip(
        "playwright.sync_api", reason="no playwright here: pip install damagepred[browser]"
    )
    with playwright.sync_playwright() as driver:
        opened = driver.chromium.launch(executable_path=program, args=list(QUIET))
        yield opened
        opened.close()


@pytest.fixture(scope="module")
def reports(tmp_path_factory: pytest.TempPathFactory, wall: xr.Dataset) -> list[Path]:
    folder = tmp_path_factory.mktemp("reports")
    write_dataset(wall, folder / "wall.nc")
    synthetic_study(folder / "house.dp", 60, failed=(4,), missing=(58, 59))
    return [write_report(folder / "wall.nc"), write_report(folder / "house.dp", replay=False)]


def _opened(browser: Any, file: Path, width: int, **options: Any) -> Any:
    page = browser.new_page(viewport={"width": width, "height": 844}, **options)
    asked: list[str] = []
    said: list[str] = []
    page.on("request", lambda request: asked.append(request.url))
    page.on("console", lambda message: said.append(message.text))
    page.on("pageerror", lambda error: said.append(str(error)))
    page.goto(file.as_uri())
    assert asked == [file.as_uri()]  # the page itself and nothing else
    assert not said
    return page


SIDEWAYS = "document.documentElement.scrollWidth - document.documentElement.clientWidth"
CUT_OFF = """() => [...document.querySelectorAll('body *')]
    .filter(e => !e.closest('.scroll') && !e.closest('pre') && !e.closest('svg'))
    .filter(e => e.getBoundingClientRect().right > document.documentElement.clientWidth + 1)
    .map(e => e.outerHTML.slice(0, 80))"""


@pytest.mark.parametrize("width", [320, 390, 820, 1400])
def test_nothing_is_cut_off_and_the_page_does_not_scroll_sideways(
    width: int, browser: Any, reports: list[Path], tmp_path: Path
) -> None:
    for file in reports:
        page = _opened(browser, file, width)
        page.screenshot(path=tmp_path / f"{file.stem}_{width}.png", full_page=True)
        assert page.evaluate(SIDEWAYS) <= 0
        assert page.evaluate(CUT_OFF) == []
        # readable: no text below 11 pixels, drawings no smaller than they can be read
        smallest = "Math.min(...[...document.querySelectorAll('p, li, td, th, dd, pre code')]"
        assert page.evaluate(f"{smallest}.map(e => parseFloat(getComputedStyle(e).fontSize)))") >= 11
        drawn = page.evaluate(
            "[...document.querySelectorAll('svg.drawing')].map(e => e.getBoundingClientRect().width).filter(w => w)"
        )
        assert drawn
        assert min(drawn) >= 400
        page.close()


def test_on_paper_it_is_a4_and_nothing_is_cut_off(browser: Any, reports: list[Path], tmp_path: Path) -> None:
    for file in reports:
        page = _opened(browser, file, 673)  # 178 mm between the margins
        page.emulate_media(media="print")
        assert page.evaluate(SIDEWAYS) <= 0
        wide = "[...document.querySelectorAll('table, svg.drawing, pre')].map(e => e.getBoundingClientRect().right)"
        assert max(page.evaluate(wide)) <= 673 + 1
        paper = page.pdf(path=tmp_path / f"{file.stem}.pdf", prefer_css_page_size=True)
        boxes = re.findall(rb"/MediaBox\s*\[\s*0 0 ([\d.]+) ([\d.]+)", paper)
        assert 3 <= len(boxes) <= 20
        for across, up in boxes:  # points
            assert float(across) == pytest.approx(595.3, abs=1.0)
            assert float(up) == pytest.approx(841.9, abs=1.0)
        page.close()


def test_links_of_the_contents_lead_somewhere(browser: Any, reports: list[Path]) -> None:
    page = _opened(browser, reports[1], 390)
    page.click("nav a[href='#caveats']")
    top = page.evaluate("document.querySelector('#caveats').getBoundingClientRect().top")
    at_end = page.evaluate("innerHeight + scrollY >= document.documentElement.scrollHeight - 2")
    assert abs(top) < 60 or at_end
    page.close()


def _ready(page: Any) -> None:
    page.wait_for_selector("figure[data-ready]")


def test_the_wall_moves_with_the_slider_and_a_click_on_its_history(browser: Any, reports: list[Path]) -> None:
    page = _opened(browser, reports[0], 900)
    _ready(page)
    assert not page.locator("#figure-wall svg").is_visible()
    assert page.inner_text(".said").startswith("At a central deflection of 12 mm: category ")
    page.locator("#figure-wall input").focus()
    page.keyboard.press("Home")
    assert page.inner_text(".said").startswith(
        "At a central deflection of 0 mm: category 0 negligible, widest crack 0 mm."
    )
    picture = page.locator("#figure-history svg")
    box, data = picture.bounding_box(), picture.evaluate("e => ({...e.dataset})")
    share = 6.0 / float(data["to"])  # of the axis
    across = float(data["left"]) + share * (float(data["right"]) - float(data["left"]))
    picture.click(position={"x": across * box["width"], "y": 0.5 * box["height"]})
    page.wait_for_function("document.querySelector('.said').textContent.includes('deflection of 6 mm')")
    page.close()


def test_a_joint_under_the_pointer_is_named_with_its_width(browser: Any, reports: list[Path], wall: xr.Dataset) -> None:
    page = _opened(browser, reports[0], 900)
    _ready(page)
    page.locator("canvas").scroll_into_view_if_needed()
    box, said = page.locator("canvas").bounding_box(), set()
    for share in range(2, 98, 2):
        for up in (0.2, 0.5, 0.8):
            page.mouse.move(box["x"] + 0.01 * share * box["width"], box["y"] + up * box["height"])
            said.add(page.inner_text(".joint"))
    widths = {float(text.split("open by ")[1].split(" mm")[0]) for text in said if "open by " in text}
    assert len(widths) > 3
    assert max(widths) <= 1e3 * max(float(wall["contact_opening"].max()), 0.0) * 1.06  # two figures


def test_without_scripts_and_on_paper_the_still_drawing_is_shown(browser: Any, reports: list[Path]) -> None:
    context = browser.new_context(java_script_enabled=False)
    page = context.new_page()
    page.goto(reports[0].as_uri())
    assert page.locator("#figure-wall svg").is_visible()
    assert not page.locator("canvas").is_visible()
    context.close()
    page = _opened(browser, reports[0], 673)
    _ready(page)
    page.emulate_media(media="print")
    assert page.locator("#figure-wall svg").is_visible()
    assert not page.locator("canvas").is_visible()
    page.close()
