from __future__ import annotations

import re
import subprocess
import sys

import pytest

from damagepred.errors import InputError, StudyError
from damagepred.plotting import save_animation, save_fragility_picture, save_study_pictures, save_wall_pictures
from damagepred.plotting.pictures import stress_sheets
from damagepred.plotting.stress import STRESSES

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
