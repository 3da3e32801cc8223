"""Studies of a house: sampling by wall, fields, damage of each wall, resume and replay."""

from pathlib import Path

import numpy as np
import pytest

from damagepred import InputError, Study, fit_fragility, open_study, solve
from damagepred.analyses.epistemic import alternatives
from damagepred.archive.folder import StudyFolder
from damagepred.campaign.replay import BIT_FOR_BIT, replay
from damagepred.campaign.sample import joint_places, solve_sample
from damagepred.campaign.settings import StudySettings, read_frozen
from damagepred.campaign.status import study_status
from damagepred.cli.sentences import status_lines
from damagepred.exports.frames import walls_frame
from damagepred.plotting import save_study_pictures
from damagepred.report.limits import study_limits
from damagepred.results.house import study_of, wall_dataset, wall_names
from damagepred.scene import House, Scene

HOUSE = """
[study]
samples = 3
seed = 3
[scene]
joint = { tensile_strength = "0.004 MPa", cohesion = "0.004 MPa" }
footing = { width = 0.2, depth = 0.1 }
[[scene.wall]]
name = "front"
start = [0.0, 0.0]
end = [1.44, 0.0]
height = 0.3
block_length = 0.48
block_height = 0.15
opening = [{ kind = "window", x = 0.48, y = 0.15, width = 0.48, height = 0.15 }]
[[scene.wall]]
name = "side"
start = [1.44, 0.0]
end = [1.44, 0.96]
height = 0.3
block_length = 0.48
block_height = 0.15
joint = { tensile_strength = "0.004 MPa", cohesion = "0.004 MPa" }
[scene.mound]
shape = "tree"
point = [-0.5, 0.0]
reach = 2.0
surface_movement = "40 mm"
[scene.movement]
kind = "settle"
increments = 2
[variables]
"wall.side.joint.cohesion" = { distribution = "lognormal", mean = "0.004 MPa", cov = 0.3 }
"wall.thickness" = { distribution = "uniform", lower = 0.1, upper = 0.12 }
"corner.pressure" = { distribution = "uniform", lower = 0.0, upper = "20 kPa" }
"mound.reach" = { distribution = "uniform", lower = 1.5, upper = 2.5 }
[variables."joint.tensile_strength"]
distribution = "lognormal"
mean = "0.004 MPa"
cov = 0.3
field = { course_correlation = 0.4 }
"""


@pytest.fixture(scope="module")
def study_file(tmp_path_factory) -> Path:
    file = tmp_path_factory.mktemp("house") / "house.toml"
    file.write_text(HOUSE)
    return file


@pytest.fixture(scope="module")
def folder(study_file) -> Path:
    Study.from_toml(study_file).run(out := study_file.with_suffix(".dp"), samples=2)
    assert Study.from_toml(study_file).run(out, samples=3).done == 3  # extended
    return out


def test_a_sample_of_a_house_stores_each_wall_and_the_worst(folder):
    ds = open_study(folder)
    assert wall_names(ds) == ["front", "side"]
    assert ds["wall_crack_width_max"].dims == ("sample", "increment", "wall")
    widths, worst = ds["wall_crack_width_max"].values, ds["crack_width_max"].values
    assert np.array_equal(np.max(widths, axis=2), worst, equal_nan=True)
    assert worst[:, -1].min() > 1e-4  # each house cracks
    known = ds["wall_damage_category"].values.min(axis=2) >= 0
    assert np.array_equal(ds["wall_damage_category"].values.max(axis=2)[known], ds["damage_category"].values[known])
    damaged = (ds["wall_damage_category"].values >= 1).sum(axis=2)
    assert np.array_equal(damaged[known], ds["damaged_walls"].values[known])
    assert ds["surface_movement"].values[:, -1] == pytest.approx(0.04)
    assert "wall_start_x" not in ds


def test_a_sample_is_solved_again_bit_for_bit(folder):
    ds, words = replay(folder, 1)
    assert words.startswith(BIT_FOR_BIT)
    assert ds["wall_crack_width_max"].dims == ("increment", "wall")


def test_resumed_parallel_and_serial_samples_are_the_same(folder, study_file):
    frozen = read_frozen(StudyFolder(folder).study_text())
    assert isinstance(frozen.scene, House)
    assert frozen.to_toml() == StudySettings.from_toml(study_file).to_toml()
    study = Study(frozen)
    inputs = {key: float(v[2]) for key, v in study.design.wall_values(3).items()}
    alone = solve_sample(frozen, study.design, 2, inputs).columns
    whole = open_study(folder)
    for name in ("wall_crack_width_max", "crack_width_max", "damaged_walls", "opening_width_change", "psi"):
        assert np.array_equal(alone[name].values[0], whole[name].values[2], equal_nan=True), name


def test_values_of_all_walls_and_of_one(study_file):
    study = Study.from_toml(study_file)
    scene, fields = study.sample(0)
    front, side = scene.wall
    assert front.thickness == side.thickness != 0.11
    assert side.joint.cohesion != 0.004e6
    assert front.joint is None
    weak = fields["joint.tensile_strength"]
    house = solve(scene, increments=1, fields=fields)
    stored = house["contact_tensile_strength"].values
    of_front = house["contact_wall"].values == 0
    mortar = (house["contact_kind"] < 2).values
    assert np.isin(stored[of_front & mortar], [*weak, scene.joint.cohesion / scene.joint.friction]).all()
    limited = side.joint.cohesion / side.joint.friction
    own = min(side.joint.tensile_strength, limited)  # a wall with its own joints has none of the field
    assert stored[~of_front & mortar] == pytest.approx(own)


def test_fields_of_the_walls_are_independent_also_by_distance(study_file):
    settings = StudySettings.from_toml(study_file)
    one = joint_places(settings.scene)
    fronts = len(joint_places(settings.scene.scenes[0]).x)
    assert not set(one.sequence[:fronts]) & set(one.sequence[fronts:])
    text = HOUSE.replace("course_correlation = 0.4", 'correlation_length = "1 m"')
    study_file.with_name("distance.toml").write_text(text)
    study = Study.from_toml(study_file.with_name("distance.toml"))
    draws = np.log([study.design.joint_values(i, one)["joint.tensile_strength"] for i in range(400)])
    near = np.corrcoef(draws[:, :fronts].T)[0, 1]
    across = np.corrcoef(draws.T)[:fronts, fronts:]
    assert near > 0.5
    assert np.abs(across).max() < 0.25
    assert np.abs(across.mean()) < 0.03


@pytest.mark.parametrize(
    ("old", "new", "words"),
    [
        ("wall.side.joint.cohesion", "wall.sied.joint.cohesion", "no wall 'sied'.*Did you mean 'side'"),
        ("wall.side.joint.cohesion", "wall.front.joint.cohesion", "leaves this number out"),
        ('"wall.thickness"', '"wall.length"', "no wall 'length'"),
        ('name = "side"', 'name = "side"\nthickness = 0.23', "walls have 0.11 m to 0.23 m; name one, .*thickness"),
        ("seed = 3", "seed = 3\nfields_from = { }", "as many walls as the scene"),
    ],
)
def test_wrong_variables_of_a_house_are_refused(old, new, words, tmp_path):
    file = tmp_path / "wrong.toml"
    file.write_text(HOUSE.replace(old, new))
    with pytest.raises(InputError, match=words):
        StudySettings.from_toml(file)


def test_status_of_a_house_counts_houses(folder):
    status = study_status(folder)
    assert (status.done, status.houses) == (3, True)
    assert status_lines(status)[0].endswith(": 3 of 3 houses done, 0 failed, 0 remaining")
    assert sum(share.walls for share in status.categories) == 3


def test_a_wall_of_a_study_reads_as_a_study_of_that_wall(folder):
    ds = open_study(folder)
    front = wall_dataset(ds, "front")
    assert np.array_equal(front["crack_width_max"], ds["wall_crack_width_max"][:, :, 0], equal_nan=True)
    assert front.sizes["opening"] == 1
    assert "opening" not in wall_dataset(ds, "side").sizes
    assert front.attrs["span"] == 1.44


def test_the_table_of_samples_has_each_wall(folder):
    ds = open_study(folder)
    frame = walls_frame(ds)
    assert frame["front_crack_width_max"].to_numpy() == pytest.approx(np.nanmax(ds["wall_crack_width_max"][:, :, 0], 1))
    assert [*frame["side_damage_category"]] == ds["wall_damage_category"][:, :, 1].max("increment").values.tolist()
    assert frame["damage_category"].tolist() == ds["damage_category"].max("increment").values.tolist()


def test_a_study_of_houses_is_drawn_and_has_no_limits_of_one_footing(folder, tmp_path):
    ds = open_study(folder)
    assert len(save_study_pictures(ds, tmp_path)) == 3
    assert study_limits(ds) is None


def test_damage_estimated_of_the_house_and_of_a_wall(folder):
    house, front, side = (alternatives(folder, 1, 0.04, wall=w)[0].found.estimate for w in (None, "front", "side"))
    assert house.value >= max(front.value, side.value)
    assert front.samples == side.samples == house.samples == 3
    curves = fit_fragility(study_of(folder, "front"), categories=[1], bootstrap=0, goodness=0)
    reached = (open_study(folder)["wall_damage_category"][:, :, 0] >= 1).any("increment")
    assert int(curves["reached"][0]) == int(reached.sum())
    with pytest.raises(InputError, match=r"wall = 'frnt'.*front, side.*Did you mean 'front'"):
        study_of(folder, "frnt")


def test_a_path_beyond_its_end_says_nothing_of_sounder_walls(study_file, tmp_path):
    text = HOUSE.replace("seed = 3", "seed = 3\nstop_at_category = 1").replace('"40 mm"', '"80 mm"')
    (file := tmp_path / "stop.toml").write_text(text)
    settings = StudySettings.from_toml(file)
    design = settings.design()
    row = solve_sample(settings, design, 0, {k: float(v[0]) for k, v in design.wall_values(3).items()}).columns
    categories, house = row["wall_damage_category"].values[0], row["damage_category"].values[0]
    end = int(np.isfinite(row["crack_width_max"].values[0]).sum())
    assert end == 2
    assert (categories[end:] == -1).all()
    assert (house[end:] >= 1).all()


def test_seasons_of_a_house_are_drawn_for_each_sample(tmp_path):
    text = HOUSE.replace('surface_movement = "40 mm"\n', "").replace(
        "increments = 2", "[scene.movement.seasons]\nyears = 1\nswing = '30 mm'\nincrements = 1"
    )
    (file := tmp_path / "seasons.toml").write_text(text)
    study = Study.from_toml(file)
    Study.from_toml(file).run(out := tmp_path / "seasons.dp", samples=2)
    ds = open_study(out)
    worst, width = ds["wall_crack_width_worst"].values, ds["wall_crack_width_max"].values
    assert worst == pytest.approx(np.maximum.accumulate(width, axis=1))
    first, second = (study.sample(i)[0].movement.largest for i in (0, 1))
    assert first != second
    assert ds["surface_movement"].max("increment").values == pytest.approx([first, second])
    assert replay(out, 1)[1].startswith(BIT_FOR_BIT)


@pytest.mark.parametrize("field", ["course_correlation = 0.4", 'correlation_length = "0.6 m"'])
def test_a_house_of_one_wall_is_sampled_as_the_wall(field, tmp_path):
    tables = """
[study]
samples = 2
seed = 5
[scene]
joint = {{ tensile_strength = "0.004 MPa", cohesion = "0.004 MPa" }}
footing = {{ width = 0.2, depth = 0.1 }}
{wall}
height = 0.45
[scene.mound]
shape = "tree"
{tree}
reach = 2.0
surface_movement = "40 mm"
[scene.movement]
kind = "settle"
shape = "mound"
increments = 2
[variables."joint.cohesion"]
distribution = "lognormal"
mean = "0.004 MPa"
cov = 0.5
field = {{ {field} }}
"""
    house = '[[scene.wall]]\nname = "a"\nstart = [0, 0]\nend = [1.44, 0]', "point = [-0.5, 0]"
    alone = "[scene.wall]\nlength = 1.44", "position = -0.5"
    rows, fields = [], []
    for name, (wall, tree) in {"house": house, "wall": alone}.items():
        (file := tmp_path / f"{name}.toml").write_text(tables.format(wall=wall, tree=tree, field=field))
        settings = StudySettings.from_toml(file)
        rows.append(solve_sample(settings, settings.design(), 1, {}).columns["crack_width_max"].values)
        fields.append(Study(settings).sample(1)[1]["joint.cohesion"])
    assert np.array_equal(*fields)
    assert np.std(np.log(fields[0])) > 0.2
    assert rows[0][0, -1] > 1e-4
    assert np.array_equal(*rows)


def test_each_wall_has_the_values_drawn_for_its_joints(study_file):
    walls = [
        {"name": w.name, "start": w.start, "end": w.end, "height": 0.3}
        for w in Study.from_toml(study_file).settings.scene.wall
    ]
    house = Scene.from_dict(
        {"wall": walls, "movement": {"kind": "settle", "increments": 1}, "mound": {"shape": "tilt"}}
    )
    counts = [len(joint_places(scene).x) for scene in house.scenes]
    drawn = 1e3 + np.arange(sum(counts))
    ds = solve(house, fields={"joint.tensile_strength": drawn})
    for number, own in enumerate(np.split(drawn, counts[:1])):
        of_wall = (ds["contact_wall"].values == number) & (ds["contact_kind"].values < 2)
        stored = np.unique(ds["contact_tensile_strength"].values[of_wall])
        assert len(stored) > 0.7 * len(own)  # the others lie on the footing
        assert np.isin(stored, own).all()
