import re
import subprocess
import sys
from xml.etree import ElementTree

import matplotlib.pyplot as plt
import pytest
import xarray as xr
from matplotlib.figure import Figure

from damagepred import plotting
from damagepred.damage import load_table
from damagepred.errors import InputError, StudyError
from damagepred.plotting import save_animation, save_fragility_picture, save_study_pictures, save_wall_pictures
from damagepred.plotting.colours import CATEGORY_COLOURS, width_colours
from damagepred.plotting.fragility import _mark_limits
from damagepred.plotting.pictures import stress_sheets
from damagepred.plotting.stress import STRESSES
from damagepred.plotting.vector import svg_of

PNG = b"\x89PNG"


def check(paths, names):
    assert [p.name for p in paths] == names
    for path in paths:
        assert path.read_bytes()[:4] == PNG
    folder = paths[0].parent
    assert sorted(p.name for p in folder.iterdir()) == sorted(names)


def test_wall_pictures_are_written(on_dpc, tmp_path):
    before = ["wall.png", "dpc_opening.png", "footing_opening.png"]
    check(
        save_wall_pictures(on_dpc, str(tmp_path / "c" / "d")),
        [*before, "opening_width.png", "cracks.png", "history.png", "stress_xx.png"],
    )


def test_every_panel_is_the_stress_and_the_increment_of_its_file(deformable):
    sheets = {name: sheet.axes for name, sheet in stress_sheets(deformable).items() if name.startswith("stress")}
    assert "stress_xx.png" in sheets
    for name, panels in sheets.items():
        title = STRESSES[name.removesuffix(".png")]
        assert [title in ax.get_title(loc="left") for ax in panels] == [True, True], name
        words = [ax.get_title(loc="left").replace("\n", " ") for ax in panels]
        assert ["deflection of 0.5 mm" in words[0], "deflection of 1 mm" in words[1]] == [True, True]
        factors = {re.search(r"exaggerated ([\d.]+) times", said)[1] for said in words}
        assert len(factors) == 1  # one as large as the other, in the same colours
        first, second = (ax.child_axes[0].get_yticks().tolist() for ax in panels)
        assert first == second
    largest, smallest = stress_sheets(deformable)["principal_stress.png"].axes
    assert STRESSES["stress_largest"] in largest.get_title(loc="left")
    assert STRESSES["stress_smallest"] in smallest.get_title(loc="left")
    assert all("deflection of 1 mm" in ax.get_title(loc="left").replace("\n", " ") for ax in (largest, smallest))


def test_a_moving_picture_has_a_frame_per_increment_in_the_same_place(cracked, tmp_path):
    from PIL import Image

    with Image.open(save_animation(cracked, tmp_path / "new" / "wall.gif")) as film:
        assert film.n_frames == cracked.sizes["increment"]
        assert film.size[0] > 600
        times = [(film.seek(frame), film.info["duration"])[1] for frame in range(film.n_frames)]
        assert times == [200] * (film.n_frames - 1) + [2000]
        assert film.info["loop"] == 0
    with pytest.raises(InputError, match=r"\.gif"):
        save_animation(cracked, tmp_path / "wall.mov")


def test_study_pictures_are_written(study, tmp_path):
    check(save_study_pictures(study, tmp_path / "a"), ["fragility.png", "crack_widths.png", "category_shares.png"])


def test_unwritable_folder_is_named(study, curves, tmp_path):
    file = tmp_path / "notes.txt"
    file.write_text("mine")
    with pytest.raises(StudyError, match=r"notes\.txt.*is a file"):
        save_study_pictures(study, file)
    with pytest.raises(StudyError, match=r"notes\.txt"):
        save_fragility_picture(curves, file / "F.png")
    assert file.read_text() == "mine"


@pytest.mark.thorough
def test_import_of_the_package_leaves_matplotlib_alone():
    code = "import sys, damagepred; assert 'matplotlib' not in sys.modules; import damagepred.plotting; "
    code += "assert 'matplotlib.pyplot' not in sys.modules"
    subprocess.run([sys.executable, "-c", code], check=True)


OF_WALLS = ["draw_wall", "draw_cracks", "draw_history"]


def test_one_figure_takes_drawings_side_by_side(on_dpc: xr.Dataset) -> None:
    plt.close("all")
    figure, axes = plt.subplots(2, 4, figsize=(30, 14), layout="constrained")
    for variable, ax in zip(("stress_xx", "contact_opening", "opening_width_change", "dpc_opening"), axes[1]):
        assert plotting.draw(on_dpc, variable, ax) is ax
    for name, ax in zip(OF_WALLS, axes.flat):
        assert getattr(plotting, name)(on_dpc, ax) is ax
    figure.canvas.draw()
    assert plt.get_fignums() == [figure.number]  # nothing else was opened
    plt.close(figure)


@pytest.mark.parametrize(("scale", "limits"), [("log", (0.1, 10.0)), ("linear", (-2.0, 30.0))])
def test_a_drawing_tells_the_page_where_its_axes_are(scale: str, limits: tuple[float, float]) -> None:
    figure, ax = plt.subplots(figsize=(4.0, 3.0))
    ax.set(xscale=scale, xlim=limits)
    root = ElementTree.fromstring(svg_of(figure, "a", "axes", ax))
    assert root.get("data-scale") == scale
    assert (float(root.attrib["data-from"]), float(root.attrib["data-to"])) == limits
    width = float(root.attrib["viewBox"].split()[2]) / 72.0  # inches
    shares = float(root.attrib["data-right"]) - float(root.attrib["data-left"])
    assert shares * width == pytest.approx(ax.get_position().width * 4.0, rel=1e-3)
    plt.close(figure)


def test_limits_of_a_long_wall_are_labelled_by_what_governs() -> None:
    """AS 2870 Table 4.1 at 15 m: 1/2000 of the length is 7.5 mm; 15, 20, 30 and 40 mm are below their shares."""
    ax = Figure().add_subplot()
    ax.set_xlim(0.0, 60.0)
    _mark_limits(ax, 15.0)
    assert [text.get_text() for text in ax.texts] == ["L/2000", "15 mm", "20 mm", "30 mm", "40 mm"]


def test_colours_of_widths_change_at_the_limits():
    colours, norm = width_colours(load_table("bre251"))
    limits = [0.1, 1.0, 5.0, 15.0, 25.0]
    assert norm.boundaries[:-1].tolist() == pytest.approx([0.0, *limits])
    assert [norm(w) for w in (0.05, 0.1, 0.99, 1.0, 14.0, 24.9, 25.0, 90.0)] == [0, 1, 1, 2, 3, 4, 5, 5]
    assert [c.lower() for c in colours.colors] == list(CATEGORY_COLOURS)
