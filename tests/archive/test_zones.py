"""Zones of deformable blocks in datasets and files."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import xarray as xr

import damagepred
from damagepred.archive.files import read_dataset, write_dataset
from damagepred.archive.schema import MESH
from damagepred.assembly import wall_model
from damagepred.enumerations import ZoneState
from damagepred.one_wall.dataset import path_values
from damagepred.one_wall.judged_path import follow
from damagepred.scene import BlockMaterial, Damage, Dpc, Loads, Movement, Scene, Solver, Wall

EXPLICIT = Solver(method="explicit", below_dpc="deformable", zone_size=0.08, tolerance=1e-2)
SCENE = Scene(
    wall=Wall(length=0.96, height=0.3),
    block=BlockMaterial(cohesion=9e3, friction=0.3, tensile_strength=2e3),
    dpc=Dpc(course=2),
    movement=Movement(kind="doming", central_deflection=1e-3, increments=2),
    loads=Loads(roof=2000.0),
    solver=EXPLICIT,
)


@pytest.fixture(scope="module")
def solved() -> xr.Dataset:
    return damagepred.solve(SCENE)


def test_a_dataset_holds_what_the_solver_reported(solved: xr.Dataset) -> None:
    model = wall_model(SCENE)
    mesh = model.mesh
    steps = list(follow(model, SCENE.solver, Damage(), 2))
    for i, step in enumerate(steps):
        zones = step.increment.zones
        for k, name in enumerate(("xx", "yy", "xy", "zz")):
            np.testing.assert_array_equal(solved[f"zone_stress_{name}"][i], zones.stress[:, k])
        for k, name in enumerate("xy"):
            np.testing.assert_array_equal(solved[f"gridpoint_displacement_{name}"][i], zones.displacement[:, k])
        np.testing.assert_array_equal(solved["zone_state"][i], zones.state)
    # shear strength held them; at rest their stresses lie just within it
    assert solved["zones_yielded_before"][-1] == (solved["zone_state"][-1] == ZoneState.YIELDED).sum() > 0
    xx, yy, xy = (solved[f"zone_stress_{name}"].values[-1] for name in ("xx", "yy", "xy"))
    strength = SCENE.block.cohesion - SCENE.block.friction * (xx + yy) / 2
    assert 0.95 < (np.hypot((xx - yy) / 2, xy) * np.hypot(1.0, SCENE.block.friction) / strength).max() <= 1.0 + 1e-9
    np.testing.assert_array_equal(solved["zone_gridpoint"], mesh.zones)
    np.testing.assert_array_equal(solved["gridpoint_x"], mesh.x)
    # all corners of a zone are gridpoints of its own block
    assert (solved["gridpoint_block"].values[mesh.zones] == solved["zone_block"].values[:, None]).all()
    assert set(solved["block_course"].values[solved["zone_block"].values]) == {0, 1}
    assert solved.attrs["zones"] == solved.sizes["zone"]
    assert solved.attrs["deformable_blocks"] == len(np.unique(solved["zone_block"]))


def test_zones_are_counted_by_what_yields() -> None:
    """Three zones yield in shear, five in tension, seven in both, two have yielded before, four are elastic."""
    state = np.repeat(np.array(ZoneState, dtype=np.int8), (4, 3, 5, 7, 2))
    step = next(follow(wall_model(SCENE), SCENE.solver, Damage(), 2))
    step = step._replace(increment=replace(step.increment, zones=step.increment.zones._replace(state=state)))
    values = path_values(wall_model(SCENE), [step])
    counts = [values[f"zones_{how}"].tolist() for how in ("in_shear", "in_tension", "yielded_before")]
    assert counts == [[10], [12], [2]]


def test_round_trip(solved: xr.Dataset, tmp_path: Path) -> None:
    write_dataset(solved, tmp_path / "wall.nc")
    again = read_dataset(tmp_path / "wall.nc")
    for name, variable in solved.variables.items():
        if str(name).startswith("zone_stress"):
            assert again[name].dtype == np.float64
            np.testing.assert_allclose(again[name], variable, rtol=1e-7, err_msg=str(name))
        else:
            np.testing.assert_array_equal(again[name], variable, err_msg=str(name))
        assert set(again[name].attrs) == set(variable.attrs), name
    write_dataset(again, tmp_path / "again.nc")
    xr.testing.assert_identical(again, read_dataset(tmp_path / "again.nc"))
    with xr.open_dataset(tmp_path / "wall.nc", mask_and_scale=False) as raw:
        assert raw["zone_stress_xx"].dtype == np.float32
        assert raw["gridpoint_displacement_x"].dtype == np.float64


def test_the_file_is_a_ugrid_mesh(solved: xr.Dataset, tmp_path: Path) -> None:
    """Section "2D triangular mesh topology" of the UGRID 1.0 conventions, attribute by attribute."""
    write_dataset(solved, tmp_path / "wall.nc")
    with xr.open_dataset(tmp_path / "wall.nc", decode_cf=False) as raw:
        assert {"CF-1.11", "UGRID-1.0"} <= set(raw.attrs["Conventions"].split())
        meshes = [n for n in raw.variables if raw[n].attrs.get("cf_role") == "mesh_topology"]
        assert meshes == [MESH]
        topology = raw[MESH].attrs
        assert topology["topology_dimension"] == 2
        assert np.issubdtype(topology["topology_dimension"].dtype, np.integer)
        nodes = topology["node_coordinates"].split()
        assert len(nodes) == 2
        (node_dim,) = {d for n in nodes for d in raw[n].dims}
        faces = raw[topology["face_node_connectivity"]]
        assert faces.attrs["cf_role"] == "face_node_connectivity"
        assert faces.dims[0] == topology["face_dimension"]
        assert faces.sizes[faces.dims[1]] == 3
        start = faces.attrs["start_index"]
        assert start.dtype == faces.dtype
        assert faces.values.min() == start == 0
        assert faces.values.max() == raw.sizes[node_dim] - 1
        for name in raw.data_vars:
            dims = raw[name].dims
            if raw[name].attrs.get("location"):
                assert raw[name].attrs["mesh"] == MESH
                assert dims[-1] == {"face": faces.dims[0], "node": node_dim}[raw[name].attrs["location"]]
            else:
                assert name in (*nodes, faces.name) or not {faces.dims[0], node_dim} & set(dims), name
        # counter-clockwise, and together the deformable blocks
        x, y = (raw[n].values[faces.values] for n in nodes)
        area = 0.5 * ((x[:, 1] - x[:, 0]) * (y[:, 2] - y[:, 0]) - (x[:, 2] - x[:, 0]) * (y[:, 1] - y[:, 0]))
        assert area.min() > 0
        assert area.sum() == pytest.approx(0.96 * 0.15)


def test_zones_need_not_be_stored(solved: xr.Dataset) -> None:
    light = damagepred.solve(SCENE, store_zones=False)
    assert not {"zone", "gridpoint"} & set(light.dims)
    counts = ["zones_in_shear", "zones_in_tension", "zones_yielded_before"]
    assert {str(n) for n in light.variables if "zone" in str(n)} == set(counts)
    for name in counts:
        np.testing.assert_array_equal(light[name], solved[name])
