"""Materials of blocks and joints. Defaults are Tables 1 and 2 of the paper (Zhuge et al.)."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace
from typing import Annotated, Any, Literal, TypeVar, get_type_hints

from pydantic import Field, model_validator
from pydantic.fields import FieldInfo

from damagepred.scene.concrete import ReinforcedConcrete
from damagepred.scene.described import described
from damagepred.scene.quantity import Count, Density, Force, FractureEnergy, Length, Pressure, Pure, Stiffness

T = TypeVar("T")


@described
class BlockMaterial:
    """Material of the bricks (``[block]``): elastic; zones may yield in shear (Mohr-Coulomb) and in tension.

    Rigid and elastic bricks break in the middle where both tensile_strength and fracture_energy are given; see
    ``solver.brick_cracks``. Only zones of deformable blocks use dilation, and cohesion without the two.

    Examples
    --------
    >>> from damagepred import BlockMaterial
    >>> brick = BlockMaterial(elastic_modulus="6 GPa")
    >>> brick.elastic_modulus, brick.density
    (6000000000.0, 2000.0)
    """

    elastic_modulus: Pressure = Field(default=9.0e9, ge=1e-3)
    """Young's modulus (Pa). The default is the paper's 9000 MPa, a *masonry* modulus."""
    poisson_ratio: Pure = Field(default=0.19, ge=0, lt=0.5)
    """Poisson's ratio (1)."""
    density: Density = Field(default=2000.0, ge=0)
    """Mass density (kg/m3)."""
    cohesion: Pressure | None = Field(default=None, ge=0)
    """C (Pa). None: zones never yield in shear, and the middle of a rigid or elastic brick has the cohesion
    tensile_strength, or tensile_strength times friction if that is more."""
    friction: Pure = Field(default=0.75, ge=0)
    """tan(phi) (1), used with a cohesion, and in the crack of a broken brick."""
    dilation: Pure = Field(default=0.0, ge=0)
    """tan(psi) (1) of the plastic flow in shear. At most the friction."""
    tensile_strength: Pressure | None = Field(default=None, ge=0)
    """Tension cut-off (Pa) of every principal stress of zones. In effect at most cohesion / friction, the apex of the
    cone. None: the apex, or no limit without cohesion. With fracture_energy, strength of the potential vertical crack
    in the middle of rigid and elastic bricks (Lourenco and Rots 1997)."""
    fracture_energy: FractureEnergy | None = Field(default=None, gt=0)
    """G_f (N/m): the work of opening a crack of unit area through a brick. Tension falls linearly with the opening.
    Less than the elastic energy of the brick: it breaks at once. None: rigid and elastic bricks do not break. Clay
    bricks: 60 to 130 N/m (van der Pluijm 1999, assumed)."""

    @model_validator(mode="after")
    def _consistent(self) -> BlockMaterial:
        if self.dilation > self.friction:
            raise ValueError(f"dilation = {self.dilation:g}: must not exceed friction = {self.friction:g}")
        return self

    @property
    def yields(self) -> bool:
        """Whether zones of this material can yield."""
        return self.cohesion is not None or self.tensile_strength is not None

    @property
    def shear_modulus(self) -> float:
        """Shear modulus G = E / (2 (1 + nu)) (Pa)."""
        return self.elastic_modulus / (2.0 * (1.0 + self.poisson_ratio))


@described
class Joint:
    """Mortar joint (``[joint]``): elastic, cracks in tension, slides with cohesion and friction.

    In the law, tension is positive: sigma <= tensile_strength and |tau| <= cohesion - sigma * friction.

    Examples
    --------
    >>> from damagepred import Joint
    >>> weak = Joint(tensile_strength="0.1 MPa", cohesion="0.15 MPa")
    >>> weak.friction
    0.75
    """

    normal_stiffness: Stiffness = Field(default=82e9, gt=0)
    """k_n (Pa/m)."""
    shear_stiffness: Stiffness = Field(default=36e9, gt=0)
    """k_s (Pa/m)."""
    tensile_strength: Pressure = Field(default=0.453e6, ge=0)
    """f_t (Pa). In effect at most cohesion / friction, the apex of the friction cone."""
    cohesion: Pressure = Field(default=0.375e6, ge=0)
    """C (Pa)."""
    friction: Pure = Field(default=0.75, ge=0)
    """tan(phi) (1)."""
    dilation: Pure = Field(default=0.0, ge=0)
    """tan(psi) (1): opening per unit of slip. At most the friction."""
    residual_tensile_strength: Pressure = Field(default=0.0, ge=0)
    """Tensile strength of the cracked joint (Pa)."""
    residual_cohesion: Pressure = Field(default=0.0, ge=0)
    """Cohesion of the cracked joint (Pa)."""
    residual_friction: Pure | None = Field(default=None, ge=0)
    """tan(phi) (1) of the cracked joint; None: as the friction."""
    brittle_shear: bool = False
    """Whether the first slip also leaves only the residual values. False is the paper's Eq. 4 as printed: slip does not
    change cohesion and tensile strength."""
    fracture_energy: FractureEnergy | None = Field(default=None, gt=0)
    """G_f (N/m, the same as J/m2): the work of opening a crack of unit area, mode I. Tension then falls linearly with
    the opening, from f_t to 0 at 2 G_f / f_t, and cohesion and friction fall with it to their residual values. None, or
    less than the elastic energy of the joint: the bond breaks at once, as in the paper. Clay brick and mortar: 5 to 20
    N/m (van der Pluijm 1999, assumed)."""
    shear_fracture_energy: FractureEnergy | None = Field(default=None, gt=0)
    """G_f (N/m), mode II: the work of slip that wears off the bond of an unopened joint, in addition to the work
    against the residual values. Cohesion, friction and tension fall linearly with the slip, to the residual values at 2
    G_f / (cohesion - residual_cohesion). Slip and opening wear off the same bond. Only with fracture_energy, without
    dilation and brittle_shear. Less than the elastic energy of the joint: the first slip breaks the bond. None: slip
    does not change the bond. Clay brick and mortar: 10 to 250 N/m (van der Pluijm 1999, assumed)."""
    softening: Literal["linear", "exponential"] = "linear"
    """Decrease of tension and bond with the opening. Exponential: first fast and then slowly, to 0 at about 5.1 G_f /
    f_t. Both have the same fracture energies."""
    compressive_strength: Pressure | None = Field(default=None, gt=0)
    """f_c (Pa), the cap. The pressure is limited, sigma >= -f_c, with permanent closing (crushing). Near the cap the
    shear is limited to |tau| <= sqrt((f_c^2 - sigma^2) / C_ss), where this is below Coulomb's limit. This is the
    ellipse of Lourenco and Rots (1997), without its hardening and softening; slip on it does not close the joint. None:
    no cap. Only without dilation."""
    cap_shear: Pure = Field(default=9.0, gt=0)
    """C_ss (1), weight of shear in the cap; 9 in Lourenco and Rots."""
    strength_factor: Pure = Field(default=1.0, gt=0)
    """Factor on tensile strength, cohesion and their residual values (1), also where they vary from joint to joint.
    Sampled without a field it is the batch: the strength of all joints of one wall."""

    @model_validator(mode="after")
    def _consistent(self) -> Joint:
        if self.dilation > self.friction:
            raise ValueError(f"dilation = {self.dilation:g}: must not exceed friction = {self.friction:g}")
        for residual, intact in (("residual_tensile_strength", "tensile_strength"), ("residual_cohesion", "cohesion")):
            if (left := getattr(self, residual)) > (most := getattr(self, intact)):
                raise ValueError(f"{residual} = {left:g}: must not exceed {intact} = {most:g}")
        if self.shear_fracture_energy is not None:
            for wrong, name in (
                (self.fracture_energy is None, "fracture_energy, which is missing"),
                (self.dilation > 0, f"dilation = 0, not {self.dilation:g}"),
                (self.brittle_shear, "brittle_shear = false"),
            ):
                if wrong:
                    raise ValueError(
                        f"shear_fracture_energy = {self.shear_fracture_energy:g}: goes only with {name}; "
                        "or take it away: shear_fracture_energy = 'none'"
                    )
        if self.compressive_strength is not None and self.dilation > 0:
            raise ValueError(
                f"compressive_strength = {self.compressive_strength:g}: goes only with dilation = 0, not "
                f"{self.dilation:g}; leave out one of the two"
            )
        if self.fracture_energy is not None and self.residual_tensile_strength > 0:
            raise ValueError(
                f"residual_tensile_strength = {self.residual_tensile_strength:g}: must be 0 with fracture_energy = "
                f"{self.fracture_energy:g}, which lets tension fall to nothing; leave out one of the two"
            )
        return self


@described
class HeadJointFactors:
    """Ratios of head joints to beds (``[head_joint.factor]``), also for values that vary from joint to joint.

    Examples
    --------
    >>> from damagepred import scene
    >>> head_joint = scene.HeadJoint(factor=scene.HeadJointFactors(tensile_strength=0.5))
    >>> head_joint.factor.tensile_strength, head_joint.factor.cohesion
    (0.5, 1.0)
    """

    normal_stiffness: Pure = Field(default=1.0, gt=0)
    shear_stiffness: Pure = Field(default=1.0, gt=0)
    tensile_strength: Pure = Field(default=1.0, ge=0)
    cohesion: Pure = Field(default=1.0, ge=0)
    friction: Pure = Field(default=1.0, ge=0)
    fracture_energy: Pure = Field(default=1.0, gt=0)
    shear_fracture_energy: Pure = Field(default=1.0, gt=0)
    compressive_strength: Pure = Field(default=1.0, gt=0)
    """Factors on these keys of ``[joint]`` (1)."""


def _overrides(of: type) -> Callable[[type[T]], type[T]]:
    """Add every key of a described class to another, with the same bounds, optional and without a value."""

    def with_keys(cls: type[T]) -> type[T]:
        hints = get_type_hints(of, include_extras=True)
        for name, key in of.__pydantic_fields__.items():  # type: ignore[attr-defined]
            of_type = FieldInfo.from_annotation(hints[name]).metadata
            bounds = [bound for bound in key.metadata if bound not in of_type]
            cls.__annotations__[name] = Annotated[(hints[name] | None, *bounds)] if bounds else hints[name] | None
            setattr(cls, name, None)
        return cls

    return with_keys


@described
@_overrides(Joint)
class HeadJoint:
    """Head joints where they differ from the beds (``[head_joint]``): any key of ``[joint]``, or factors on it.

    Head joints are often filled poorly. Calibrated micro-models find a strength of 0.56 and a fracture energy of 0.66
    of the beds' (a Delft thesis on spandrel tests of 2024, secondary). A key without a value takes the value of
    ``[joint]``, times its factor.

    Attributes
    ----------
    factor : HeadJointFactors or None
        Factors on the values of ``[joint]`` for keys without a value here. None: 1.
    normal_stiffness, shear_stiffness, tensile_strength, cohesion, friction, dilation, residual_tensile_strength, \
    residual_cohesion, residual_friction, brittle_shear, fracture_energy, shear_fracture_energy, softening, \
    compressive_strength, cap_shear, strength_factor : float, bool, str or None
        Same meaning as in ``[joint]``.

    Examples
    --------
    >>> from damagepred import HeadJoint, Scene
    >>> scene = Scene(head_joint=HeadJoint(tensile_strength="0.2 MPa"))
    >>> scene.heads.tensile_strength, scene.joint.tensile_strength
    (200000.0, 453000.0)
    """

    factor: HeadJointFactors | None = None

    def joint(self, bed: Joint) -> Joint:
        """Head joints of a wall with these beds."""
        return replace(bed, **{name: self.of_bed(name, getattr(bed, name)) for name in Joint.__dataclass_fields__})

    def of_bed(self, name: str, value: Any) -> Any:
        """Value of a key of head joints.

        Parameters
        ----------
        name, value
            Key, and its value of the beds: a number or an array of numbers, a word, a bool or None.
        """
        given = getattr(self, name)
        if given is not None or value is None or isinstance(value, bool | str):
            return value if given is None else given
        return getattr(self.factor, name, 1.0) * value


@described
class Dpc:
    """Damp-proof course (``[dpc]``): the bed joint on top of the given number of courses.

    It carries no tension. Stiffness and cap are as in ``[joint]`` unless given here.

    Examples
    --------
    >>> from damagepred import Dpc, Scene
    >>> scene = Scene(dpc=Dpc(course=2, friction=0.4))
    >>> scene.dpc.friction
    0.4
    """

    course: Count = Field(default=2, ge=1)
    """Number of courses below the dpc (1 or more, fewer than the wall has)."""
    friction: Pure = Field(default=0.5, ge=0)
    """tan(phi) (1), 0.5 in the paper."""
    cohesion: Pressure = Field(default=0.0, ge=0)
    """C (Pa), 0 in the paper."""
    normal_stiffness: Stiffness | None = Field(default=None, gt=0)
    """k_n (Pa/m); None: as the joints."""
    shear_stiffness: Stiffness | None = Field(default=None, gt=0)
    """k_s (Pa/m); None: as the joints."""


@described
class Footing:
    """Footing beam under the wall (``[footing]``), the paper's 300 x 300 mm concrete by default.

    A prescribed movement moves the underside of the wall directly, whatever these values. On jacks or on a mound the
    footing is a beam that bends freely: a chain of rigid segments, one below each brick of the first course. The
    sections between them bend and shear.

    Examples
    --------
    >>> from damagepred import Footing, ReinforcedConcrete
    >>> Footing(depth="500 mm").depth
    0.5
    >>> Footing(concrete=ReinforcedConcrete(bottom="3-L12TM")).concrete.bottom
    '3-L12TM'
    """

    width: Length = Field(default=0.3, ge=1e-3, le=100)
    """Width of the cross-section (m)."""
    depth: Length = Field(default=0.3, ge=1e-3, le=100)
    """Depth of the cross-section (m)."""
    elastic_modulus: Pressure = Field(default=7.0e9, ge=1e-3)
    """Young's modulus (Pa)."""
    poisson_ratio: Pure = Field(default=0.2, ge=0, lt=0.5)
    """Poisson's ratio (1)."""
    density: Density = Field(default=2130.0, ge=0)
    """Mass density (kg/m3)."""
    segment_length: Length | None = Field(default=None, ge=1e-3)
    """Longest segment of the beam (m). None: as long as the bricks of the first course."""
    joint: Joint | None = None
    """Bed between footing and first course (``[footing.joint]``). None: the wall's mortar."""
    concrete: ReinforcedConcrete | None = None
    """Reinforced concrete that cracks (``[footing.concrete]``). None: elastic with ``elastic_modulus``."""

    @model_validator(mode="after")
    def _mesh_fits(self) -> Footing:
        if self.concrete is None:
            return self
        cover = self.concrete.cover
        needed = sum(cover + wires for _, wires in (self.concrete.bottom_wires, self.concrete.top_wires) if wires > 0)
        if needed >= self.depth:
            raise ValueError(
                f"concrete.cover = {cover:g} m: with the wires it takes {needed:g} m of a footing of depth = "
                f"{self.depth:g} m; make the cover smaller or the footing deeper"
            )
        return self


@described
class Loads:
    """Dead loads on the wall (``[loads]``); self weight comes from the densities.

    Examples
    --------
    >>> from damagepred import Loads
    >>> Loads(roof="12 kN").roof
    12000.0
    """

    roof: Force = Field(default=0.0, ge=0)
    """Total vertical load (N), downwards, uniform along the top of the wall. In a file also per length of the wall,
    such as ``"3 kN/m"``."""
