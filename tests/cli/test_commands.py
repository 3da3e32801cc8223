"""The commands as a user types them; what moves is said first; reports that cannot be."""

import os
import re
import signal
import subprocess
import sys
import time
from pathlib import Path
from typing import get_args

import numpy as np
import pandas as pd
import pytest
import xarray as xr

from damagepred.archive.files import read_dataset, write_dataset
from damagepred.archive.folder import StudyFolder, open_study
from damagepred.campaign.settings import StudySettings
from damagepred.campaign.template import Template
from damagepred.one_wall.solve import solve
from damagepred.scene import Scene
from tests.cli.conftest import Run
from tests.report.conftest import WALL
from tests.synthetic_studies import synthetic_study

SMALL_SCENE = """
title = "small wall"
wall = { length = 1.44, height = 0.6 }
dpc = { course = 2 }
opening = [{ x = 0.6, y = 0.3, width = 0.24, height = 0.15 }]
movement = { central_deflection = "1 mm", increments = 3 }
"""

CONTRACT = """
central_deflection deflection_ratio block_x block_y block_displacement_x block_displacement_y block_rotation contact_x
contact_y contact_kind contact_length contact_opening contact_slip contact_normal_stress contact_shear_stress
contact_state unbalanced_force_ratio base_reaction crack_width_max dpc_opening_max dpc_separation_length
opening_width_change damage_category
"""


def loaded_by(*arguments: object) -> set[str]:
    """Modules that a command loads, and packages."""
    look = """
import sys
sys.argv = ["damagepred", *sys.argv[1:]]
from damagepred.cli import main
try:
    main()
except SystemExit:
    pass
print("LOADED", *sys.modules)
"""
    command = [sys.executable, "-c", look, *map(str, arguments)]
    said = subprocess.run(command, check=True, capture_output=True, text=True).stdout
    return set(said.partition("LOADED")[2].split())


def test_help_loads_nothing_that_computes() -> None:
    loaded = loaded_by("--help")
    assert "typer" in loaded
    heavy = {"numpy", "scipy", "numba", "pandas", "xarray", "netCDF4", "matplotlib", "pydantic", "pint", "rich"}
    assert not loaded & heavy


def test_status_and_fragility_load_no_solver_scene_or_plot(tmp_path: Path) -> None:
    folder = synthetic_study(tmp_path / "house.dp")
    other = {"numba", "matplotlib", "scipy.stats", "scipy.interpolate", "damagepred.scene.scene", "damagepred.assembly"}
    assert not loaded_by("status", folder) & {*other, "scipy.optimize", "scipy.spatial", "damagepred.results.tables"}
    assert not loaded_by("fragility", folder) & {*other, "damagepred.uq.comparison", "damagepred.uq.observations"}


def test_solve_loads_no_study_and_no_statistics(tmp_path: Path) -> None:
    (tmp_path / "wall.toml").write_text(SMALL_SCENE)
    other = {"matplotlib", "scipy.stats", "scipy.optimize", "scipy.interpolate"}
    studies = {"damagepred.campaign.settings", "damagepred.uq.exceedance", "damagepred.uq.fragility"}
    assert not loaded_by("solve", tmp_path / "wall.toml") & {*other, *studies}


def test_solve_writes_every_variable_of_the_contract(command: Run, tmp_path: Path) -> None:
    (tmp_path / "wall.toml").write_text(SMALL_SCENE)
    result = command("solve", tmp_path / "wall.toml", "-o", tmp_path / "wall.nc", "--plot", tmp_path / "pictures")
    assert result.code == 0, result.err
    ds = read_dataset(tmp_path / "wall.nc")
    for name in CONTRACT.split():
        assert name in ds.variables, name
        assert ds[name].attrs["long_name"]
        assert "units" in ds[name].attrs or "flag_meanings" in ds[name].attrs
    assert ds.sizes["increment"] == 4
    assert ds.attrs["Conventions"] == "CF-1.11"
    assert {"scene", "damagepred_version", "damagepred_commit", "schema_version"} <= set(ds.attrs)
    assert {p.name for p in (tmp_path / "pictures").iterdir()} >= {"wall.png", "dpc_opening.png", "opening_width.png"}
    assert "small wall" in result.out
    again = command("plot", tmp_path / "wall.nc", "-o", tmp_path / "more")
    assert again.code == 0, again.err
    assert (tmp_path / "more" / "wall.png").stat().st_size > 5000


@pytest.mark.thorough
def test_check_solve_study_and_report_say_what_is_assumed_of_the_ground(command: Run, tmp_path: Path) -> None:
    scene = SMALL_SCENE.replace('central_deflection = "1 mm"', 'shape = "mound"')
    (tmp_path / "wall.toml").write_text(scene)
    (tmp_path / "study.toml").write_text('scene = "wall.toml"\n[study]\nsamples = 1\n')
    words = "y_s = 40 mm, swelling soil of 4000 kPa/m"
    for asked in (("check", "wall.toml"), ("check", "study.toml"), ("solve", "wall.toml"), ("study", "study.toml")):
        more = ("-o", tmp_path / "wall.nc") if asked[0] == "solve" else ()
        result = command(asked[0], tmp_path / asked[1], *more)
        assert result.code == 0, result.err
        assert words in " ".join(result.out.split())
    for archive in ("wall.nc", "study.dp"):
        assert command("report", tmp_path / archive, "-o", tmp_path / "page.html").code == 0
        assert words in " ".join((tmp_path / "page.html").read_text().split())


def test_the_template_is_valid_and_never_overwrites(command: Run, tmp_path: Path) -> None:
    from damagepred.campaign.settings import StudySettings

    assert command("new", tmp_path / "house.toml").code == 0
    settings = StudySettings.from_toml(tmp_path / "house.toml")
    joints = {"joint.tensile_strength", "joint.cohesion", "joint.strength_factor"}
    assert set(settings.variables) == {*joints, "dpc.friction"}
    before = (tmp_path / "house.toml").read_bytes()
    result = command("new", tmp_path / "house.toml")
    assert result.code == 2
    assert "exists and was not changed" in result.err
    assert (tmp_path / "house.toml").read_bytes() == before


def test_the_template_of_a_house_is_a_scene_that_can_be_built(command: Run, tmp_path: Path) -> None:
    from damagepred.assembly.house import house_model
    from damagepred.scene import House, Scene

    assert command("new", tmp_path / "house.toml", "--template", "house").code == 0
    house = Scene.from_toml(tmp_path / "house.toml")
    assert isinstance(house, House)
    assert (house.names[0], len(house.junctions)) == ("front", 6)
    assert house_model(house).n_blocks > 3000


@pytest.mark.parametrize("name", [name for name in get_args(Template) if name != "house"])
def test_each_template_describes_a_wall_that_can_be_built(command: Run, tmp_path: Path, name: str) -> None:
    from damagepred.one_wall.judged_path import model_of
    from damagepred.study import Study

    assert command("new", tmp_path / "house.toml", "--template", name).code == 0
    text = (tmp_path / "house.toml").read_text(encoding="utf-8")
    assert "damagepred study house.toml -j 2" in text
    assert "{" not in text.replace("{ course_correlation = 0.4 }", "").replace('{ "joint.cohesion" = 0.7 }', "")
    scene, _ = Study.from_toml(tmp_path / "house.toml").sample(0)
    shape = {"wall": "three_loads", "seasons": "three_loads", "jacks": "jacks"}.get(name, "mound")
    assert (scene.movement.shape, bool(scene.control_joint)) == (shape, name == "control-joint")
    assert model_of(scene).n_blocks > 150


def test_check_prices_a_study(command: Run, small_study_file: Path) -> None:
    result = command("check", small_study_file, "--full")
    assert result.code == 0, result.err
    assert "valid" in result.out
    assert "6 walls with 4 uncertain numbers" in result.out
    assert re.search(r"solver: quasi_static, 0\.\d+ MB of matrices", result.out)


def test_fragility_by_time_writes_the_table_of_years(command: Run, tmp_path: Path) -> None:
    (tmp_path / "years.toml").write_text(
        "[study]\nsamples = 4\nstop_at_category = 'none'\n[scene.wall]\nlength = 1.44\nheight = 0.6\n"
        "[scene.movement.seasons]\nyears = 2\nswing = '6 mm'\nincrements = 2\n[variables.'joint.tensile_strength']\n"
        "distribution = 'lognormal'\nmean = '0.3 MPa'\ncov = 0.5\n"
    )
    folder = tmp_path / "years.dp"
    assert command("study", tmp_path / "years.toml").code == 0
    written = command("fragility", folder, "--intensity", "time", "--csv", tmp_path / "t.csv", "--bootstrap", 20)
    assert written.code == 0, written.err
    assert "t_years.csv" in written.out
    table = pd.read_csv(tmp_path / "t_years.csv").set_index(["category", "year"])
    worst = open_study(folder)["damage_category_worst"].values
    assert worst.max() > 0
    for category, year in table.index:
        share = (worst[:, int(4 * year)] >= category).mean()
        assert table.loc[(category, year), "so_far"] == pytest.approx(share)
    assert table["so_far"].between(table["so_far_lower"], table["so_far_upper"]).all()


def test_the_road_from_study_to_fragility(command: Run, small_study_file: Path, tmp_path: Path) -> None:
    folder = tmp_path / "small.dp"
    assert command("study", small_study_file, "-n", 6, "-j", 2).code == 0
    assert (open_study(folder)["status"].values == 0).all()
    status = command("status", folder)
    assert "6 of 6 walls done, 0 failed, 0 remaining" in status.out
    files = ("-o", tmp_path / "c.nc", "--plot", tmp_path / "c.png", "--csv", tmp_path / "c.csv")
    result = command("fragility", folder, *files, "--bootstrap", 20)
    assert result.code == 0, result.err
    curves = read_dataset(tmp_path / "c.nc")
    assert curves["probability"].dims == ("category", "intensity")
    reached = curves["reached"].values + curves["not_reached"].values
    assert (reached == 6).all()
    assert (tmp_path / "c.png").stat().st_size > 5000
    assert len((tmp_path / "c.csv").read_text().splitlines()) == 1 + curves["probability"].size
    replayed = command("replay", folder, 2, "-o", tmp_path / "s2.nc")
    assert replayed.code == 0, replayed.err
    assert "bit for bit" in replayed.out
    assert "contact_opening" in read_dataset(tmp_path / "s2.nc")
    assert command("plot", folder, "-o", tmp_path / "pictures").code == 0


def test_an_interrupt_before_anything_is_done_is_said(command, small_study_file, monkeypatch) -> None:
    def interrupted(*_: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(StudySettings, "from_toml", interrupted)
    ended = command("study", small_study_file)
    assert (ended.code, ended.err) == (130, "damagepred: interrupted\n")


@pytest.mark.thorough
def test_an_interrupted_study_keeps_what_was_done_and_goes_on(small_study_file: Path, tmp_path: Path) -> None:
    folder = StudyFolder(tmp_path / "small.dp")
    arguments = [sys.executable, "-m", "damagepred", "study", str(small_study_file), "-n", "400", "-j", "2"]
    # a session of its own: the interrupt reaches command and workers alike, as from a terminal
    run = subprocess.Popen(arguments, stdout=subprocess.PIPE, stderr=subprocess.PIPE, text=True, start_new_session=True)
    while len(folder.finished()) < 3 and run.poll() is None:
        time.sleep(0.02)
    os.killpg(run.pid, signal.SIGINT)
    out, _ = run.communicate()
    assert run.returncode == 130
    assert "interrupted" in out
    kept = {p.name: p.read_bytes() for p in folder.parts.iterdir()}
    done = len(folder.finished())
    assert 3 <= done < 400
    assert not folder.failed_samples()
    assert int((open_study(folder.path)["status"].values == 0).sum()) == done
    resumed = subprocess.run([*arguments[:5], "-n", str(done + 2), "-j", "2"], capture_output=True, text=True)
    assert resumed.returncode == 0, resumed.stderr
    assert all((folder.parts / name).read_bytes() == content for name, content in kept.items())
    first = open_study(folder.path)["status"].values[: done + 2]
    assert (first == 0).all()


@pytest.mark.worker_processes
@pytest.mark.thorough
def test_failed_samples_end_with_code_3(command: Run, tmp_path: Path, small_study_file: Path) -> None:
    text = small_study_file.read_text().replace(
        "[scene]", '[scene]\nsolver = { method = "explicit", tolerance = 1e-9, maximum_cycles = 100 }'
    )
    small_study_file.write_text(text)
    result = command("study", small_study_file, "-n", 2)
    assert result.code == 3
    assert "did not settle within 100 cycles" in result.err
    assert "block" in result.err
    assert "2 failed" in result.out
    assert StudyFolder(tmp_path / "small.dp").failed_samples() == {0, 1}
    assert np.array_equal(open_study(tmp_path / "small.dp")["status"].values, [2, 2])
    fragility = command("fragility", tmp_path / "small.dp")
    assert fragility.code == 2
    assert "no finished sample" in fragility.err


@pytest.mark.thorough
def test_fragility_exports_beside_the_study_or_the_output(command: Run, tmp_path: Path) -> None:
    folder = tmp_path / "house.dp"
    synthetic_study(folder, 60)
    result = command("fragility", folder, "--export", "pelicun", "--categories", "1,2", "--bootstrap", 0)
    assert result.code == 0, result.err
    assert (tmp_path / "house_pelicun.csv").is_file()
    assert (tmp_path / "house_pelicun.json").is_file()
    result = command("fragility", folder, "--export", "openquake", "-o", tmp_path / "c.nc", "--bootstrap", 0)
    assert result.code == 2
    assert "have no curve to export: category 3: never reached; category 4: never reached" in result.err
    assert "--categories 1,2" in result.err
    result = command("fragility", folder, "--categories", "one")
    assert result.code == 2
    assert "category = 'one': must be a number from 1, or one of very slight, slight" in result.err


def test_judge_again_from_the_command_line(command: Run, tmp_path: Path) -> None:
    (tmp_path / "wall.toml").write_text(SMALL_SCENE)
    assert command("solve", tmp_path / "wall.toml", "-o", tmp_path / "wall.nc").code == 0
    result = command("judge", tmp_path / "wall.nc", "--table", "bre251", "-o", tmp_path / "again.nc")
    assert result.code == 0, result.err
    assert "judged again by BRE Digest 251" in result.out
    assert "out of level or plumb, at worst: not noticeable" in result.out
    assert read_dataset(tmp_path / "again.nc").attrs["damage_table"] == "BRE Digest 251"
    old = Path(__file__).parents[1] / "archive" / "version_1"
    result = command("judge", old, "--plasterboard", "-o", tmp_path / "study.nc")
    assert result.code == 0, result.err
    assert "walls by the worst category of their path" in result.out
    assert "judged by their widest crack alone" in result.out
    assert command("fragility", tmp_path / "study.nc").code == 0
    result = command("judge", old, "--table", "bre25")
    assert (result.code, "Did you mean 'bre251'" in result.err) == (2, True)


def test_folders_are_listed_and_those_in_use_are_kept(command: Run, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.setenv("NUMBA_CACHE_DIR", str(tmp_path))
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "none"))
    monkeypatch.setattr("tempfile.tempdir", str(tmp_path))
    idle, used = tmp_path / "kernels-1", tmp_path / "kernels-2"
    for folder, process in ((idle, "99999999-ended"), (used, f"{os.getpid()}-here")):
        (folder / "joint_1").mkdir(parents=True)
        (folder / "joint_1" / "law.1.nbc").write_bytes(bytes(3_000_000))
        (folder / "processes" / process).mkdir(parents=True)
    os.link(idle / "joint_1" / "law.1.nbc", idle / "processes" / "99999999-ended" / "law.1.nbc")
    listed = command("cache").out
    assert f"{idle}: 3 MB, not in use" in listed.replace("\n", "")
    assert f"{used}: 3 MB, in use" in listed.replace("\n", "")
    assert idle.exists()
    assert f"{idle}: 3 MB, removed" in command("cache", "--clear").out.replace("\n", "")
    assert not idle.exists()
    assert used.exists()


SCENE = """
title = "small"
wall = { length = 2.0, height = 0.6, block_length = 0.5, block_height = 0.2 }
movement = { kind = "doming", central_deflection = "1 mm", increments = 1 }
"""
SAID = [
    "small: valid; wall 2 m long, 0.6 m high, openings: 0, no dpc",
    "  The middle of the ground goes up by 1 mm, to nothing at both ends",
    "  one wall, all numbers as given",
]


def test_check_says_wall_movement_variables_and_cost_in_four_lines(command: Run, tmp_path: Path) -> None:
    (tmp_path / "wall.toml").write_text(SCENE)
    lines = command("check", tmp_path / "wall.toml").out.splitlines()
    assert lines[:3] == SAID
    assert len(lines) == 4
    assert lines[3].startswith("  one wall: ")
    full = command("check", tmp_path / "wall.toml", "--full").out
    assert "  solver: quasi_static" in full
    assert "accuracy = " in full


def test_new_ends_with_the_movement_of_its_file(command: Run, tmp_path: Path) -> None:
    result = command("new", tmp_path / "house.toml", "--template", "mound")
    words = "Both ends of the ground go up by 30 mm, to nothing at 1.8 and 7.2 m; swelling clay, 4000 kPa/m"
    assert words in " ".join(f"{result.out} {result.err}".split())


@pytest.mark.parametrize(("given", "file"), [("pictures", "pictures/scene.png"), ("house.svg", "house.svg")])
def test_check_draws_into_a_folder_or_a_file(command: Run, tmp_path: Path, given: str, file: str) -> None:
    (tmp_path / "wall.toml").write_text(SCENE)
    result = command("check", tmp_path / "wall.toml", "--plot", tmp_path / given)
    assert result.code == 0, result.err
    assert (tmp_path / file).stat().st_size > 1000
    assert f"drew {tmp_path / file}" in result.out


def test_check_refuses_another_ending_of_the_picture_before_it_solves(command: Run, tmp_path: Path) -> None:
    (tmp_path / "wall.toml").write_text(SCENE)
    refused = command("check", tmp_path / "wall.toml", "--plot", tmp_path / "wall.csv")
    assert refused.code == 2
    assert ".png" in refused.err


SCENE_OF_ZONES = """
title = "soft foot"
wall = { length = 0.96, height = 0.3 }
dpc = { course = 2 }
movement = { central_deflection = "1 mm", increments = 2 }
solver = { method = "explicit", below_dpc = "deformable", zone_size = 0.08, tolerance = 1e-2 }
"""

WEAK = '[block]\ncohesion = "10 kPa"\nfriction = 0.3\ntensile_strength = "3.3 kPa"\n[loads]\nroof = 2000'


def test_solve_tells_of_zones(command: Run, tmp_path: Path) -> None:
    (tmp_path / "wall.toml").write_text(SCENE_OF_ZONES)
    result = command("solve", tmp_path / "wall.toml", "-o", tmp_path / "wall.nc")
    assert result.code == 0, result.err
    assert "9 of 18 blocks deformable, 128 zones in plane stress; none of them yields" in result.out
    assert read_dataset(tmp_path / "wall.nc").sizes["zone"] == 128
    (tmp_path / "weak.toml").write_text(SCENE_OF_ZONES + WEAK)
    result = command("solve", tmp_path / "weak.toml", "-o", tmp_path / "weak.nc", "--no-zones")
    assert result.code == 0, result.err
    assert "128 zones in plane stress; at the end " in result.out
    ds = read_dataset(tmp_path / "weak.nc")
    assert "zone" not in ds.sizes
    assert f"{int(ds['zones_yielded_before'][-1])} have yielded before" in result.out


def test_check_estimates_the_cost_of_zones(command: Run, tmp_path: Path) -> None:
    (tmp_path / "wall.toml").write_text(SCENE_OF_ZONES)
    result = command("check", tmp_path / "wall.toml", "--full")
    assert result.code == 0, result.err
    assert "9 deformable blocks: 128 zones, " in result.out
    assert "MB of results (none with --no-zones)" in result.out


@pytest.fixture(scope="module")
def wall() -> xr.Dataset:
    return solve(Scene.from_dict(WALL))


def test_missing_and_unfit_files_are_named(command: Run, wall: xr.Dataset, tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text("[wall]\n")
    (tmp_path / "text.nc").write_text("no netCDF")
    (tmp_path / "empty").mkdir()
    write_dataset(wall[["crack_width_max"]].assign_attrs(schema_version=2), tmp_path / "part.nc")
    write_dataset(wall, tmp_path / "wall.nc")
    for arguments, said in (
        (["nowhere.dp"], "no such file or study folder"),
        ([tmp_path / "scene.toml"], "is a description, and a result is needed"),
        ([tmp_path / "text.nc"], "is not a readable netCDF file"),
        ([tmp_path / "part.nc"], "is not the result of solve or replay (it has no contact_opening)"),
        ([tmp_path / "empty"], "is not a study folder"),
        ([tmp_path / "wall.nc", "-o", tmp_path / "empty"], "is a folder; give the name of a file"),
        ([tmp_path / "wall.nc", "-o", tmp_path / "no" / "r.html"], "its folder does not exist"),
    ):
        result = command("report", *arguments)
        assert result.code == 2, arguments
        assert said in result.err
        assert "Traceback" not in result.err
    assert not list(tmp_path.glob("*.html"))


@pytest.mark.skipif(os.geteuid() == 0, reason="nothing is read-only to root")
def test_a_read_only_folder_is_refused(command: Run, wall: xr.Dataset, tmp_path: Path) -> None:
    folder = tmp_path / "locked"
    folder.mkdir()
    write_dataset(wall, folder / "wall.nc")
    folder.chmod(0o555)
    result = command("report", folder / "wall.nc")
    assert result.code == 2
    assert "no permission to write there; choose another place" in result.err


def test_a_study_with_no_wall_done_is_refused(command: Run, tmp_path: Path) -> None:
    folder = synthetic_study(tmp_path / "house.dp", 8, missing=range(8))
    result = command("report", folder)
    assert result.code == 2
    assert "no finished sample yet; run `damagepred study` first" in result.err


def test_the_command_says_where_the_report_is(command: Run, tmp_path: Path) -> None:
    study_folder = synthetic_study(tmp_path / "house.dp", 12)
    result = command("report", study_folder, "--no-replay", "--bootstrap", 10)
    assert result.code == 0, result.err
    assert f"wrote {study_folder.with_name('house_report.html')}" in result.out.replace("\n", "")
