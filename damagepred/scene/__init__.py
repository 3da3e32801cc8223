"""Scene descriptions: wall, footing, movement, loads and solver, frozen and validated. Imported when first used."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING, Any

if TYPE_CHECKING:
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

_HOMES = {
    name: module
    for module, names in {
        "concrete": "ReinforcedConcrete",
        "dynamics": "BaseMotion Dynamics",
        "house": "House",
        "loading": "Load Loading Support",
        "material_library": "Material masonry_library",
        "materials": "BlockMaterial Dpc Footing HeadJoint HeadJointFactors Joint Loads",
        "mound": "Mound",
        "movement": "Movement",
        "movement_stage": "Seasons SeasonStep Stage",
        "plan": "Corner PlanWall",
        "plan_ground": "GroundSource PlanMound",
        "rig": "Rig",
        "scene": "Scene",
        "settings": "Damage DamageState Report Solver",
        "site": "SiteClass StandardFooting site_class site_classes standard_footing standard_footings suction_depth",
        "soil": "Soil SoilLayer Suction surface_movement",
        "strain": "Creep Strain",
        "wall": "ControlJoint Opening Wall",
    }.items()
    for name in names.split()
}

__all__ = [*_HOMES]


def __getattr__(name: str) -> Any:
    if name in _HOMES:
        return getattr(import_module(f"damagepred.scene.{_HOMES[name]}"), name)
    raise AttributeError(f"module 'damagepred.scene' has no attribute '{name}'")
