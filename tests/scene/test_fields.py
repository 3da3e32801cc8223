"""Every key of every table: its default, its unit and bounds, or its words, typed here from what is documented."""

import math
from typing import Any

import pytest

from damagepred.campaign.settings import Sampling
from damagepred.errors import InputError
from damagepred.scene.concrete import ReinforcedConcrete
from damagepred.scene.dynamics import BaseMotion, Dynamics
from damagepred.scene.loading import Load, Loading, Support
from damagepred.scene.materials import BlockMaterial, Dpc, Footing, HeadJoint, HeadJointFactors, Joint, Loads
from damagepred.scene.mound import Mound
from damagepred.scene.movement import Movement, Stage
from damagepred.scene.rig import Rig
from damagepred.scene.seasons import Seasons, SeasonStep
from damagepred.scene.settings import Damage, Solver
from damagepred.scene.soil import Soil
from damagepred.scene.soil_log import SoilLayer, Suction
from damagepred.scene.strain import Creep, Strain
from damagepred.scene.wall import ControlJoint, Opening, Wall
from damagepred.uq.stopping import StopWhen

TABLES = (
    Wall,
    Opening,
    ControlJoint,
    BlockMaterial,
    Joint,
    HeadJoint,
    HeadJointFactors,
    Dpc,
    Footing,
    ReinforcedConcrete,
    Loads,
    Movement,
    Stage,
    Seasons,
    SeasonStep,
    Rig,
    Soil,
    SoilLayer,
    Suction,
    Mound,
    Support,
    Load,
    Loading,
    Strain,
    Creep,
    Solver,
    Damage,
    Dynamics,
    BaseMotion,
    Sampling,
    StopWhen,
)

KEYS = """
Wall
  length = 6 m (0 1000]
  height = 2.4 m (0 200]
  thickness = 0.11 m [0.001 5]
  block_length = 0.24 m [0.001 20]
  block_height = 0.075 m [0.001 20]
  bond = running | running stack
  fit = gauged | gauged cut
  bond_offset = 0 m [0 10000]
  shortest_cut = None m (0 10000]
Opening
  kind = window | window door
  x = required m [0 10000]
  y = 0 m [0 10000]
  width = required m (0 10000]
  height = required m (0 10000]
  lintel_bearing = 0.12 m (0 10000]
ControlJoint
  x = required m (0 10000]
  width = 0.01 m [0 10000]
  through_dpc = False
BlockMaterial
  elastic_modulus = 9e+09 Pa [0.001 1e+16]
  poisson_ratio = 0.19 1 [0 0.5)
  density = 2000 kg/m**3 [0 100000]
  cohesion = None Pa [0 1e+16]
  friction = 0.75 1 [0 1e+15]
  dilation = 0 1 [0 1e+15]
  tensile_strength = None Pa [0 1e+16]
Joint
  normal_stiffness = 8.2e+10 Pa/m [0.001 1e+18]
  shear_stiffness = 3.6e+10 Pa/m [0.001 1e+18]
  tensile_strength = 453000 Pa [0 1e+16]
  cohesion = 375000 Pa [0 1e+16]
  friction = 0.75 1 [0 1e+15]
  dilation = 0 1 [0 1e+15]
  residual_tensile_strength = 0 Pa [0 1e+16]
  residual_cohesion = 0 Pa [0 1e+16]
  residual_friction = None 1 [0 1e+15]
  brittle_shear = False
  softening = linear | linear exponential
  fracture_energy = None N/m (0 1e+12]
  shear_fracture_energy = None N/m (0 1e+12]
  compressive_strength = None Pa (0 1e+16]
  cap_shear = 9 1 (0 1e+15]
  strength_factor = 1 1 (0 1e+15]
HeadJoint
  factor = None
  normal_stiffness = None Pa/m [0.001 1e+18]
  shear_stiffness = None Pa/m [0.001 1e+18]
  tensile_strength = None Pa [0 1e+16]
  cohesion = None Pa [0 1e+16]
  friction = None 1 [0 1e+15]
  dilation = None 1 [0 1e+15]
  residual_tensile_strength = None Pa [0 1e+16]
  residual_cohesion = None Pa [0 1e+16]
  residual_friction = None 1 [0 1e+15]
  brittle_shear = None
  fracture_energy = None N/m (0 1e+12]
  shear_fracture_energy = None N/m (0 1e+12]
  softening = None | linear exponential
  compressive_strength = None Pa (0 1e+16]
  cap_shear = None 1 (0 1e+15]
  strength_factor = None 1 (0 1e+15]
HeadJointFactors
  normal_stiffness = 1 1 (0 1e+15]
  shear_stiffness = 1 1 (0 1e+15]
  tensile_strength = 1 1 [0 1e+15]
  cohesion = 1 1 [0 1e+15]
  friction = 1 1 [0 1e+15]
  fracture_energy = 1 1 (0 1e+15]
  shear_fracture_energy = 1 1 (0 1e+15]
  compressive_strength = 1 1 (0 1e+15]
Dpc
  course = 2 whole [1 max]
  friction = 0.5 1 [0 1e+15]
  cohesion = 0 Pa [0 1e+16]
  normal_stiffness = None Pa/m [0.001 1e+18]
  shear_stiffness = None Pa/m [0.001 1e+18]
Footing
  width = 0.3 m [0.001 100]
  depth = 0.3 m [0.001 100]
  elastic_modulus = 7e+09 Pa [0.001 1e+16]
  poisson_ratio = 0.2 1 [0 0.5)
  density = 2130 kg/m**3 [0 100000]
  segment_length = None m [0.001 10000]
  joint = None
  concrete = None
ReinforcedConcrete
  law = cracked | cracked branson
  grade = N25
  bottom = 3-L11TM
  top = None
  cover = 0.04 m [0 10000]
  elastic_modulus = None Pa (0 1e+16]
  tensile_strength = None Pa (0 1e+16]
  tension_stiffening = 1 1 [0 1]
  steel_modulus = 2e+11 Pa (0 1e+16]
  steel_strength = 5e+08 Pa (0 1e+16]
  hardening = 0.006 1 [0.0001 1)
  branson_exponent = 3 1 [1 6]
  earlier_moment = 0 N*m [0 1e+12]
Loads
  roof = 0 N [0 1e+12]
Movement
  kind = dishing | dishing doming settle heave
  central_deflection = 0.008 m [0 10000]
  increments = 20 whole [1 max]
  shape = three_loads | three_loads parabola arc table jacks mound loads
  table = () 1 [-1e+15 1e+15]
  table_ends = refuse | refuse cut level extend
  stage = ()
  history = None
  seasons = None
Stage
  kind = dishing | dishing doming settle heave
  central_deflection = None m [0 10000]
  surface_movement = None m [0 10000]
  load_factor = None 1 [-1 1]
  increments = 10 whole [1 max]
  time = None year (0 10000]
  strain = None 1 [-0.01 0.01]
Seasons
  years = 30 whole [1 200]
  trend = 0 m [-10000 10000]
  swing = 0.01 m [0 10000]
  swing_share = 0.6 1 [0 1e+15]
  swing_cov = 0.3 1 [0 1e+15]
  shift = 0 m [0 10000]
  correlation = 0.3 1 [0 1)
  increments = 4 whole [1 max]
  step = ()
  seed = 1 whole [0 max]
SeasonStep
  year = required year [0 10000]
  movement = required m [-10000 10000]
  rise = 1 year [0 10000]
  end = None year (0 10000]
  probability = 1 1 [0 1]
SoilLayer
  thickness = required m (0 10000]
  shrink_swell_index = required 1 [0 0.3]
  name = None
Suction
  climate_zone = None whole [1 6]
  change = 1.2 1 (0 5]
  cracked_share = 0.5 1 [0 1]
  restraint = 2 1 [1 1e+15]
  restraint_depth = 5 m (0 10000]
  below_log = None | extend inert
Rig
  supports = () m [-10000 10000]
  jacks = () m [-10000 10000]
  support = held | held lift_off
  support_stiffness = 1e+10 N/m [0.001 1e+18]
  control = deflection | deflection load
  jack_load = None N [0 1e+12]
  stop_at_zero = True
Soil
  swelling_stiffness = 4e+06 Pa/m [0.001 1e+18]
  shrinking_stiffness = 5e+06 Pa/m [0.001 1e+18]
  shear_stiffness = None Pa/m [0.001 1e+18]
  friction = 0.5 1 [0 1e+15]
Mound
  shape = walsh | walsh mitchell tree pipe tunnel table
  surface_movement = 0.04 m [0 10000]
  movement_ratio = None 1 [0 1e+15]
  suction_depth = 4 m (0 10000]
  embedment = 0 m [0 10000]
  edge_distance = None m (0 10000]
  doming_suction_divisor = 8 1 (0 1e+15]
  doming_movement_divisor = 36 1 (0 1e+15]
  dishing_length_share = 0.2 1 (0 1e+15]
  dishing_edge_base = 0.6 m (0 10000]
  dishing_movement_divisor = 25 1 (0 1e+15]
  exponent = None 1 [1 1e+15]
  exponent_factor = 1.5 1 (0 1e+15]
  position = None m [-10000 10000]
  reach = None m (0 10000]
  tunnel_depth = None m (0 10000]
  trough_width = 0.5 1 (0 1e+15]
  table = () 1 [-1e+15 1e+15]
  table_ends = refuse | refuse cut level extend
Support
  x = required m [0 10000]
  width = required m (0 10000]
Load
  side = top | top left right
  at = None m [0 10000]
  width = None m (0 10000]
  direction = towards | towards along
  share = 1 1 (0 1e+15]
Loading
  control = force | force displacement opening
  force = None N (0 1e+12]
  displacement = None m (0 10000]
  opening = None m (0 10000]
  gauge = () m [-10000 10000]
  beam = none | none free level clamped
  bearing_stiffness = None Pa/m [0.001 1e+18]
  bearing_friction = 0 1 [0 1e+15]
Strain
  growth = 0 1 [-0.01 0.01]
  growth_law = logarithmic | logarithmic exponential
  growth_years = 15 year (0 10000]
  growth_time = 1 year (0 10000]
  temperature_change = 0 1 [-100 100]
  temperature_swing = 0 1 [0 100]
  warmest = 0.5 year [0 1]
  thermal_expansion = 8e-06 1 [0 0.0001]
Creep
  coefficient = 1 1 [0 20]
  relaxation_time = None year (0 10000]
Solver
  method = quasi_static | quasi_static explicit
  accuracy = standard | draft standard fine reference
  blocks = rigid | rigid elastic deformable
  above_dpc = None | rigid elastic deformable
  below_dpc = None | rigid elastic deformable
  zone_size = None m (0 10000]
  zone_size_above_dpc = None m (0 10000]
  zone_size_below_dpc = None m (0 10000]
  zone_size_footing = None m (0 10000]
  footing = None | none beam deformable
  elastic_subdivisions = 4 whole [2 16]
  plane = stress | stress strain
  lump_block_elasticity = True
  quadrature = lobatto | lobatto midpoint
  contacts_per_interface = 3 whole [1 9]
  no_tension_subdivisions = None whole [1 16]
  tolerance = None 1 (0 1e+15]
  step_energy_tolerance = 0.01 1 (0 1e+15]
  condense = True
  damping = 0.8 1 [0 1)
  ramp_cycles = 10000 whole [1 max]
  ramp_pieces = 100 whole [1 max]
  maximum_cycles = 200000 whole [1 max]
  time_step_safety = 0.9 1 (0 1]
  energy_tolerance = 0.05 1 (0 1e+15]
  snap_through_tolerance = 0.05 1 (0 1e+15]
  displacement_tolerance = 0.05 1 (0 1e+15]
  crack_tolerance = 0.05 1 (0 1e+15]
  symmetric_half = True
  advanced = None
Damage
  table = as2870 | as2870 bre251
  plasterboard = False
  count_rule = True
  group_distance = 1 m (0 10000]
  group_count = 2 whole [2 max]
  dpc_threshold = 0.001 m (0 10000]
  measure = joint | joint band
  band_gauge = 0.75 m (0 10000]
  band_threshold = 0 m [0 10000]
  footing_threshold = 0.001 m (0 10000]
  count_footing_gap = False
Dynamics
  duration = None s (0 1e+09]
  outputs = 100 whole [1 max]
  base = ()
  movement_time = None s (0 1e+09]
  ground_pieces = 100 whole [1 max]
  damping = none | none viscous rayleigh local
  damping_ratio = 0.05 1 [0 1)
  frequency = 10 Hz (0 1e+09]
  second_frequency = 100 Hz (0 1e+09]
  local_damping = 0.8 1 [0 1)
  contact_damping = 0 1 [0 10]
  time_step_safety = None 1 (0 1]
  start = equilibrium | equilibrium unstressed
  new_contacts = True
  stop_at_rest = False
  rest_speed = 0.001 m/s (0 10000]
BaseMotion
  kind = record | half_sine full_sine rectangular record
  direction = x | x y
  acceleration = 0 m/s**2 [-1e+06 1e+06]
  duration = 0 s [0 1e+09]
  start = 0 s [0 1e+09]
  file = None
  time = () s (-inf 1e+09]
  values = () 1 [-1e+15 1e+15]
  quantity = acceleration | acceleration velocity displacement
  scale = 1 1 [-1e+15 1e+15]
  baseline = none | none velocity
Sampling
  title = None
  samples = 100 whole [1 max]
  seed = 1 whole [0 max]
  sampler = sobol | sobol lhs random table
  replicates = 1 whole [1 1024]
  table = None
  table_columns = ()
  importance = {}
  nominal_share = 0 1 [0 1)
  stop_when = None
  time_budget = None s (0 1e+09]
  epistemic = {}
  fields_from = None
  store_fields = True
  material_scatter = False
  stop_at_category = None
  crossed = False
  movement = path | path sampled both
StopWhen
  category = required whole [1 max]
  quantity = probability | probability median
  at = None m (0 10000]
  half_width = None m (0 10000]
  relative_half_width = None 1 (0 1e+15]
  confidence = 0.9 1 (0 1)
  first = 64 whole [8 max]
"""
"""A key with its default; of a number the unit and the interval of values, ends in square brackets included; of words
those there are."""


def keys() -> list[tuple[type, str, str]]:
    """Return table, key and what is said of it."""
    found, table = [], ""
    for line in KEYS.strip().splitlines():
        key, _, said = line.strip().partition(" = ")
        if said:
            found.append((next(kind for kind in TABLES if kind.__name__ == table), key, said))
        table = table if said else key
    return found


def test_damping_by_hand() -> None:
    """At 4 Hz and 6 Hz, 8 and 12 pi a second: 2 x 0.1 x 8 pi; 2 x 0.1 x 96 pi / 20 and 2 x 0.1 / (20 pi)."""
    expected = {
        "none": (0, 0),
        "local": (0, 0),
        "viscous": (1.6 * math.pi, 0),
        "rayleigh": (0.96 * math.pi, 0.01 / math.pi),
    }
    for damping, (mass, stiffness) in expected.items():
        run = Dynamics(damping=damping, damping_ratio=0.1, frequency=4.0, second_frequency=6.0)
        assert (run.mass_damping, run.stiffness_damping) == pytest.approx((mass, stiffness), rel=1e-12)


@pytest.mark.parametrize(
    ("dry", "keys", "share"),
    [
        (True, {}, 0.25),
        (False, {}, 0.5),
        (True, {"damping": "viscous"}, 0.5),
        (True, {"contact_damping": 0.1}, 0.5),
        (True, {"time_step_safety": 0.7}, 0.7),
    ],
)
def test_share_of_the_largest_time_step(dry: bool, keys: dict[str, Any], share: float) -> None:
    assert Dynamics(**keys).step_share(dry) == share


@pytest.mark.parametrize(
    ("kind", "keys", "words"),
    [
        (BaseMotion, {"kind": "half_sine"}, "duration: a pulse"),
        (BaseMotion, {"kind": "half_sine", "duration": 1.0, "file": "a.csv"}, "only read with kind = 'record'"),
        (BaseMotion, {"kind": "full_sine", "duration": 1.0, "time": (0.0, 1.0)}, "only read"),
        (BaseMotion, {"kind": "rectangular", "duration": 1.0, "values": (0.0, 1.0)}, "only read"),
        (BaseMotion, {"file": "a.csv", "time": (0.0, 1.0)}, "leave out one"),
        (BaseMotion, {"file": "a.csv", "values": (0.0, 1.0)}, "leave out one"),
        (BaseMotion, {}, "0 times and 0 values"),
        (BaseMotion, {"time": (0.0,), "values": (1.0,)}, "1 times and 1 values"),
        (BaseMotion, {"time": (0.0, 1.0, 2.0), "values": (1.0, 1.0)}, "3 times and 2 values"),
        (BaseMotion, {"time": (0.0, 2.0, 1.0), "values": (1.0, 2.0, 3.0)}, "must rise"),
        (BaseMotion, {"time": (0.0, 1.0, 1.0), "values": (1.0, 2.0, 3.0)}, "must rise"),
        (Dynamics, {"damping": "rayleigh", "frequency": 100.0}, "must be above frequency = 100 Hz"),
        (Joint, {"dilation": 0.76}, "dilation = 0.76: must not exceed friction = 0.75"),
        (BlockMaterial, {"dilation": 0.76}, "dilation = 0.76: must not exceed friction = 0.75"),
        (Joint, {"residual_tensile_strength": 0.454e6}, "must not exceed tensile_strength = 453000"),
        (Joint, {"residual_cohesion": 0.376e6}, "must not exceed cohesion = 375000"),
        (Joint, {"shear_fracture_energy": 50.0}, "fracture_energy, which is missing"),
        (Joint, {"shear_fracture_energy": 50.0, "fracture_energy": 9.0, "dilation": 0.1}, "dilation = 0, not 0.1"),
        (Joint, {"shear_fracture_energy": 50.0, "fracture_energy": 9.0, "brittle_shear": True}, "brittle_shear = fal"),
        (Joint, {"compressive_strength": 9e6, "dilation": 0.1}, "goes only with dilation = 0, not 0.1"),
        (Joint, {"fracture_energy": 9.0, "residual_tensile_strength": 0.5}, "must be 0 with fracture_energy"),
        (Wall, {"block_length": 6.1}, "must not exceed the wall's length = 6"),
        (Wall, {"bond_offset": 0.1}, "take fit = 'cut'"),
        (Wall, {"fit": "cut", "bond_offset": 0.24}, "must be less than a brick"),
        (Wall, {"block_height": 2.5}, "must not exceed the wall's height = 2.4"),
        (Solver, {"contacts_per_interface": 1}, "Lobatto needs 2"),
        (Damage, {"table": "bre251", "plasterboard": True}, "no such allowance"),
        (Mound, {"shape": "mitchell", "embedment": 4.0}, "must be less than suction_depth = 4 m"),
        (Mound, {"shape": "tunnel"}, "needs the distance"),
        (Mound, {"table": ((0, 0), (1, 1))}, "only read with shape = 'table'"),
        (Mound, {"shape": "table", "table": ((0, 0),)}, "at least 2 points"),
        (Mound, {"shape": "table", "table": ((0.1, 0), (1, 1))}, "must rise from 0 to 1"),
        (Mound, {"shape": "table", "table": ((0, 0), (0.9, 1))}, "must rise from 0 to 1"),
        (Mound, {"shape": "table", "table": ((0, 0), (0.4, 2), (0.4, 1), (1, 1))}, "must rise from 0 to 1"),
        (Rig, {"control": "load"}, "jack_load: is missing"),
        (Rig, {"jack_load": 0.0}, "only read with control = 'load'"),
        (Rig, {"jacks": (2.0, 1.0, 2.0)}, "jacks: 2 m is there twice"),
        (Rig, {"supports": (2.0, 1.0, 2.0)}, "supports: 2 m is there twice"),
        (Rig, {"supports": (2.0,)}, "one support does not hold"),
    ],
)
def test_keys_that_do_not_go_together(kind: type, keys: dict[str, Any], words: str) -> None:
    with pytest.raises(InputError, match=words):
        kind(**keys)


@pytest.mark.parametrize(
    ("kind", "keys"),
    [
        (BaseMotion, {"kind": "half_sine", "duration": 1e-3}),
        (BaseMotion, {"file": "a.csv"}),
        (BaseMotion, {"time": (0.0, 1e-9), "values": (1.0, 1.0)}),
        (Dynamics, {"damping": "viscous", "frequency": 100.0}),
        (Dynamics, {"damping": "rayleigh", "frequency": 99.0}),
        (Joint, {"dilation": 0.75}),
        (BlockMaterial, {"dilation": 0.75}),
        (Joint, {"residual_tensile_strength": 0.453e6, "residual_cohesion": 0.375e6}),
        (Joint, {"shear_fracture_energy": 50.0, "fracture_energy": 9.0}),
        (Joint, {"compressive_strength": 9e6}),
        (Wall, {"block_length": 6.0, "block_height": 2.4}),
        (Solver, {"contacts_per_interface": 2}),
        (Solver, {"contacts_per_interface": 1, "quadrature": "midpoint"}),
        (Damage, {"plasterboard": True}),
        (Mound, {"shape": "mitchell", "embedment": 3.999}),
        (Mound, {"shape": "mitchell", "embedment": 4.0, "exponent": 2.0}),
        (Mound, {"embedment": 4.0}),
        (Mound, {"shape": "table", "table": ((0, 0), (1, 1))}),
        (Mound, {"shape": "tunnel", "reach": 1.0}),
        (Rig, {"control": "load", "jack_load": 0.0}),
        (Rig, {"supports": (2.0, 1.0), "jacks": (3.0,)}),
    ],
)
def test_keys_at_the_edge_of_what_goes(kind: type, keys: dict[str, Any]) -> None:
    kind(**keys)
