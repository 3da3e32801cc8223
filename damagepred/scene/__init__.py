"""Scene descriptions: wall, footing, movement, loads and solver, frozen and validated."""

from damagepred.scene.concrete import ReinforcedConcrete
from damagepred.scene.dynamics import BaseMotion, Dynamics
from damagepred.scene.house import House
from damagepred.scene.loading import Load, Loading, Support
from damagepred.scene.material_library import Material, masonry_library
from damagepred.scene.materials import BlockMaterial, Dpc, Footing, HeadJoint, HeadJointFactors, Joint, Loads
from damagepred.scene.mound import Mound
from damagepred.scene.movement import Movement
from damagepred.scene.movement_stage import Seasons, SeasonStep, Stage
from damagepred.scene.plan import Corner, PlanWall
from damagepred.scene.plan_ground import GroundSource, PlanMound
from damagepred.scene.rig import Rig
from damagepred.scene.scene import Scene
from damagepred.scene.settings import Damage, DamageState, Report, Solver
from damagepred.scene.site import (
    SiteClass,
    StandardFooting,
    site_class,
    site_classes,
    standard_footing,
    standard_footings,
    suction_depth,
)
from damagepred.scene.soil import Soil, SoilLayer, Suction, surface_movement
from damagepred.scene.strain import Creep, Strain
from damagepred.scene.wall import ControlJoint, Opening, Wall

__all__ = [
    "BaseMotion",
    "BlockMaterial",
    "ControlJoint",
    "Corner",
    "Creep",
    "Damage",
    "DamageState",
    "Dpc",
    "Dynamics",
    "Footing",
    "GroundSource",
    "HeadJoint",
    "HeadJointFactors",
    "House",
    "Joint",
    "Load",
    "Loading",
    "Loads",
    "Material",
    "Mound",
    "Movement",
    "Opening",
    "PlanMound",
    "PlanWall",
    "ReinforcedConcrete",
    "Report",
    "Rig",
    "Scene",
    "SeasonStep",
    "Seasons",
    "SiteClass",
    "Soil",
    "SoilLayer",
    "Solver",
    "Stage",
    "StandardFooting",
    "Strain",
    "Suction",
    "Support",
    "Wall",
    "masonry_library",
    "site_class",
    "site_classes",
    "standard_footing",
    "standard_footings",
    "suction_depth",
    "surface_movement",
]
