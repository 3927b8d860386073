"""Types of package ist. Shapes, units and frames: docs/python.md, and help() of every name.

[u] is the meshes' own unit; poses are rows qw, qx, qy, qz, tx, ty, tz. Of a single pose, columns have
no leading n: numbers and (3,) arrays.
"""

import enum
import os
from collections.abc import Callable, Sequence
from typing import Any, Literal, Protocol, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import gpu as gpu

__version__: str

_Path = str | os.PathLike[str]
_Column = Any  # NDArray of one row a pose; a number for one pose
_SphereMeasure = Literal["matched", "inner"]
_Measure = Literal["matched", "inner", "exact"]
_FieldUse = Literal["automatic", "never", "always"]
_Grid = Literal["banded", "uniform", "explicit", "implicit", "hybrid"]
_Scale = float | ArrayLike  # a factor, or (3,) of each axis
_Device = Literal["auto", "cpu", "cuda"]

class Error(RuntimeError): ...
class OpenMeshError(Error): ...

class QueryStatus(enum.IntEnum):
    ok = 0
    budget_exhausted = 1
    invalid_input = 2
    not_held = 3
    error_exceeded = 4

class Overlapping(enum.IntEnum):
    no = 0
    yes = 1
    unknown = 2

class ImpactStatus(enum.IntEnum):
    no_impact = 0
    impact = 1
    unresolved = 2
    overlapping = 3
    budget_exhausted = 4
    invalid_input = 5
    not_held = 6

@final
class Progress:
    @property
    def total(self) -> float: ...  # [0, 1]
    @property
    def stage(self) -> str: ...
    @property
    def spheres(self) -> int: ...
    @property
    def coverage(self) -> float: ...  # [0, 1]
    @property
    def radius(self) -> float: ...  # [u]
    @property
    def fraction(self) -> float: ...  # [0, 1]
    @property
    def elapsed(self) -> float: ...  # [s]

@final
class MeshReport:
    @property
    def vertices(self) -> int: ...
    @property
    def triangles(self) -> int: ...
    @property
    def components(self) -> int: ...
    @property
    def boundary_edges(self) -> int: ...
    @property
    def nonmanifold_edges(self) -> int: ...
    @property
    def flipped_components(self) -> int: ...
    @property
    def degenerate_triangles(self) -> int: ...
    @property
    def self_intersections(self) -> int: ...
    @property
    def shells(self) -> int: ...
    @property
    def meets_itself(self) -> bool: ...
    @property
    def filled_holes(self) -> int: ...
    @property
    def repaired(self) -> bool: ...
    @property
    def volume(self) -> float: ...  # [u³]
    @property
    def notes(self) -> list[str]: ...

@final
class Mesh:
    def __init__(self, vertices: ArrayLike, triangles: ArrayLike) -> None: ...
    @property
    def vertices(self) -> NDArray[np.float64]: ...  # (n, 3) [u], read-only view
    @property
    def triangles(self) -> NDArray[np.uint32]: ...  # (m, 3), read-only view
    @property
    def declared_up_axis(self) -> Literal["X", "Y", "Z"] | None: ...
    @property
    def declared_unit(self) -> float: ...  # [m]

_Drawn = Asset | Mesh | ClosedMesh

class _MeshLike(Protocol):
    """trimesh.Trimesh, and the like."""

    vertices: Any  # (n, 3) [u]
    faces: Any  # (m, 3)

_OpenMesh = Mesh | _Path | tuple[ArrayLike, ArrayLike] | _MeshLike

@final
class ClosedMesh:
    @property
    def vertices(self) -> NDArray[np.float64]: ...  # (n, 3) [u], read-only view
    @property
    def triangles(self) -> NDArray[np.uint32]: ...  # (m, 3), read-only view
    @property
    def name(self) -> str: ...
    @property
    def report(self) -> MeshReport: ...

def load_mesh(path: _Path, *, weld_tolerance: float = 0.0) -> Mesh: ...
def from_trimesh(mesh: _MeshLike) -> Mesh: ...
def close_mesh(
    mesh: _OpenMesh, *, name: str = "mesh", repair: bool = False, scale: _Scale = 1.0,
) -> ClosedMesh: ...
def sample_mesh(name: str) -> Mesh: ...

@final
class MassProperties:
    @property
    def volume(self) -> float: ...  # [u³]
    @property
    def centre_of_mass(self) -> NDArray[np.float64]: ...  # (3,) [u]
    @property
    def inertia(self) -> NDArray[np.float64]: ...  # (3, 3) [u⁵]
    @property
    def volume_error(self) -> float: ...  # [u³]
    @property
    def centre_of_mass_error(self) -> float: ...  # [u]
    @property
    def inertia_error(self) -> float: ...  # [u⁵]

@final
class Bounds:
    @property
    def lower(self) -> NDArray[np.float64]: ...  # (3,) [u]
    @property
    def upper(self) -> NDArray[np.float64]: ...  # (3,) [u]
    @property
    def centre(self) -> NDArray[np.float64]: ...  # (3,) [u]
    @property
    def radius(self) -> float: ...  # [u]

@final
class Invariant:
    @property
    def name(self) -> str: ...
    @property
    def worst(self) -> float: ...
    @property
    def meaning(self) -> str: ...
    @property
    def where(self) -> int: ...
    @property
    def checked(self) -> int: ...
    @property
    def violations(self) -> int: ...

@final
class PartnerError:
    @property
    def partner(self) -> str: ...
    @property
    def median(self) -> float: ...
    @property
    def poses(self) -> int: ...

@final
class TargetedAsset:
    @property
    def asset(self) -> Asset: ...
    @property
    def measured_error(self) -> float: ...
    @property
    def poses(self) -> int: ...
    @property
    def partners(self) -> list[PartnerError]: ...
    @property
    def met(self) -> bool: ...
    @property
    def stop(self) -> str: ...

@final
class Asset:
    @staticmethod
    def load(path: _Path) -> Asset: ...
    @staticmethod
    def from_bytes(data: Any, name: str = "asset") -> Asset: ...
    def save(self, path: _Path) -> None: ...
    def to_bytes(self) -> bytes: ...
    def info(self) -> dict[str, Any]: ...
    # (n, 3) vertices [u], (m, 3) triangles
    def surface(self) -> tuple[NDArray[np.float64], NDArray[np.uint32]]: ...
    def spheres(self, which: _SphereMeasure = "matched") -> NDArray[np.float64]: ...  # (n, 4) [u]
    def mass_properties(self, pose: ArrayLike | None = None, scale: float = 1.0) -> MassProperties: ...
    def bounds(self, pose: ArrayLike | None = None, scale: float = 1.0) -> Bounds: ...
    @property
    def sphere_count(self) -> int: ...
    @property
    def volume(self) -> float: ...  # [u³]
    @property
    def coverage(self) -> float: ...  # [0, 1]
    @property
    def protrusion(self) -> float: ...  # [u]
    @property
    def has_field(self) -> bool: ...
    @property
    def field_error(self) -> float: ...  # [u]
    @property
    def mesh_triangles(self) -> int: ...  # 0: it holds no mesh
    @property
    def mesh_error(self) -> float: ...  # [u]
    @property
    def mesh_state(self) -> Literal["none", "own", "resolved", "simplified", "unresolved"]: ...
    @property
    def counted_twice(self) -> float: ...  # [u³]

def bake(
    mesh: ClosedMesh | _OpenMesh, *, max_spheres: int = 10000, target_coverage: float = 1.0,
    min_radius: float = 0.0, time_limit: float = 0.0, epsilon: float = 0.0, grid: _Grid = "banded",
    seed: int = 0, threads: int = 0, device: _Device = "auto", surface: str | float = "all",
    scale: _Scale = 1.0, progress: Callable[[Progress], Any] | None = None,
) -> Asset: ...
def bake_surface(
    mesh: ClosedMesh | _OpenMesh, *, surface: str | float = "all", scale: _Scale = 1.0,
    threads: int = 0, progress: Callable[[Progress], Any] | None = None,
) -> Asset: ...
def bake_to_error(
    mesh: ClosedMesh | _OpenMesh, relative_error: float = 0.01, at_overlap: float = 0.001, *,
    max_spheres: int = 0, target_coverage: float = 1.0, min_radius: float = 0.0,
    time_limit: float = 0.0, epsilon: float = 0.0, grid: _Grid = "banded", seed: int = 0,
    threads: int = 0, device: _Device = "auto", surface: str | float = "all",
    scale: _Scale = 1.0, progress: Callable[[Progress], Any] | None = None,
) -> TargetedAsset: ...
def check(
    asset: Asset, mesh: ClosedMesh | _OpenMesh, *, scale: _Scale = 1.0, threads: int = 0,
) -> list[Invariant]: ...

class Field: ...

@final
class HalfSpaceField(Field):
    def __init__(self, normal: ArrayLike = (0.0, 0.0, 1.0), offset: float = 0.0) -> None: ...

@final
class BoxField(Field):
    def __init__(self, half_extents: ArrayLike) -> None: ...

@final
class BallField(Field):
    def __init__(self, radius: float) -> None: ...

@final
class CapsuleField(Field):
    def __init__(self, radius: float, half_height: float) -> None: ...

@final
class CylinderField(Field):
    def __init__(self, radius: float, half_height: float) -> None: ...

@final
class HeightField(Field):
    def __init__(
        self, heights: ArrayLike, *, spacing: ArrayLike = (1.0, 1.0), lowest: float = -1e300,
        highest: float = 1e300,
    ) -> None: ...

@final
class DistanceGridField(Field):
    def __init__(
        self, distances: ArrayLike, *, origin: ArrayLike, spacing: float, error: float = 0.0
    ) -> None: ...

@final
class MeshField(Field):
    def __init__(self, asset: Asset) -> None: ...

@final
class SolidRows: ...

@final
class Solids:
    def __init__(
        self, solids: Sequence[Asset | Field], *, device: Any = "cpu",
    ) -> None: ...  # "cpu", "cuda", "cuda:1", a torch.device
    def __len__(self) -> int: ...
    def __getitem__(self, index: int | _Rows) -> SolidRows: ...  # or (n,) indices
    @property
    def device(self) -> str: ...
    @property
    def fields(self) -> list[int]: ...
    @property
    def bytes(self) -> int: ...  # of device memory

_Solid = Asset | Field | SolidRows
_Rows = Any  # ArrayLike; of solids on a GPU an array of any framework in its memory

@final
class Penetration:
    @property
    def volume(self) -> _Column: ...  # (n,) [u³]
    @property
    def volume_min(self) -> _Column: ...  # (n,) [u³] exact: the true volume is at least this; else the sum's interval
    @property
    def volume_max(self) -> _Column: ...  # (n,) [u³] and at most this
    @property
    def centroid(self) -> NDArray[np.float64]: ...  # (n, 3) [u]
    @property
    def force(self) -> NDArray[np.float64]: ...  # (n, 3) [u²] on B
    @property
    def torque(self) -> NDArray[np.float64]: ...  # (n, 3) [u³] on B, about its origin
    @property
    def pose_gradient(self) -> NDArray[np.float64]: ...  # (n, 7) dV/d(pose of B)
    @property
    def pose_gradient_a(self) -> NDArray[np.float64]: ...  # (n, 7) dV/d(pose of A)
    @property
    def scale_gradient(self) -> _Column | None: ...  # (n,) [u³] dV/d(scale of B)
    @property
    def scale_gradient_a(self) -> _Column | None: ...  # (n,) [u³] dV/d(scale of A)
    @property
    def status(self) -> _Column: ...  # (n,) QueryStatus
    @property
    def node_visits(self) -> _Column: ...  # (n,)
    @property
    def sphere_pairs(self) -> _Column: ...  # (n,)

@final
class Lenses:
    @property
    def centre(self) -> NDArray[np.float64]: ...  # (n, 3) [u] world
    @property
    def axis(self) -> NDArray[np.float64]: ...  # (n, 3) unit, from A's sphere to B's
    @property
    def radius(self) -> NDArray[np.float64]: ...  # (n,) [u]
    @property
    def thickness(self) -> NDArray[np.float64]: ...  # (n,) [u]
    @property
    def sphere_a(self) -> NDArray[np.uint32]: ...  # (n,)
    @property
    def sphere_b(self) -> NDArray[np.uint32]: ...  # (n,)

@final
class PairFit:
    @property
    def grain_a(self) -> float: ...  # [u]
    @property
    def grain_b(self) -> float: ...  # [u]
    @property
    def ratio(self) -> float: ...  # ≥ 1
    @property
    def a_is_coarser(self) -> bool: ...
    @property
    def has_surface(self) -> bool: ...
    @property
    def needs_surface(self) -> bool: ...
    @property
    def fits(self) -> bool: ...

class Plot:
    def save(self, path: _Path) -> None: ...

def plot(
    solids: _Drawn | Sequence[_Drawn], poses: ArrayLike | None = None, *,
    scales: ArrayLike | None = None, path: _Path | None = None,
) -> Plot: ...
def poses(
    rotations: ArrayLike, translations: ArrayLike | None = None, *,
    order: Literal["wxyz", "xyzw"] | None = None,
) -> NDArray[np.float64]: ...  # (7,) or (n, 7)
def lenses(
    a: Asset, b: Asset, pose: ArrayLike, *, pose_a: ArrayLike | None = None, scale: float = 1.0,
    scale_a: float = 1.0, measure: _SphereMeasure = "matched", detail_a: int = 0, detail_b: int = 0,
) -> Lenses: ...
def without_protrusion(
    whole: Penetration, a: Asset, b: Asset, poses: ArrayLike, *, scales: ArrayLike | None = None,
    poses_a: ArrayLike | None = None, scales_a: ArrayLike | None = None,
) -> Penetration: ...
def pair_fit(a: Asset, b: Asset, *, scale: float = 1.0, scale_a: float = 1.0) -> PairFit: ...

@final
class RayHits:
    @property
    def distance(self) -> _Column: ...  # (n,) [u] inf: no hit
    @property
    def point(self) -> NDArray[np.float64]: ...  # (n, 3) [u] world
    @property
    def normal(self) -> NDArray[np.float64]: ...  # (n, 3) unit, outward
    @property
    def triangle(self) -> _Column: ...  # (n,)
    @property
    def status(self) -> _Column: ...  # (n,) QueryStatus

@final
class SurfacePoints:
    @property
    def distance(self) -> _Column: ...  # (n,) [u] < 0 inside
    @property
    def error(self) -> _Column: ...  # (n,) [u]
    @property
    def point(self) -> NDArray[np.float64]: ...  # (n, 3) [u] world
    @property
    def gradient(self) -> NDArray[np.float64]: ...  # (n, 3) unit, outward
    @property
    def triangle(self) -> _Column: ...  # (n,)
    @property
    def status(self) -> _Column: ...  # (n,) QueryStatus

@final
class Separation:
    @property
    def distance(self) -> _Column: ...  # (n,) [u]
    @property
    def distance_min(self) -> _Column: ...  # (n,) [u] certified
    @property
    def distance_max(self) -> _Column: ...  # (n,) [u] certified
    @property
    def point_a(self) -> NDArray[np.float64]: ...  # (n, 3) [u] world
    @property
    def point_b(self) -> NDArray[np.float64]: ...  # (n, 3) [u] world
    @property
    def normal(self) -> NDArray[np.float64]: ...  # (n, 3) unit, from A to B
    @property
    def status(self) -> _Column: ...  # (n,) QueryStatus
    @property
    def node_visits(self) -> _Column: ...  # (n,)
    @property
    def sphere_pairs(self) -> _Column: ...  # (n,)

@final
class ContactPatches:
    @property
    def penetration(self) -> Penetration: ...
    @property
    def status(self) -> _Column: ...  # (n,) QueryStatus
    @property
    def count(self) -> _Column: ...  # (n,)
    @property
    def id(self) -> NDArray[np.uint64]: ...  # (n, m)
    @property
    def centroid(self) -> NDArray[np.float64]: ...  # (n, m, 3) [u]
    @property
    def normal(self) -> NDArray[np.float64]: ...  # (n, m, 3) unit, from A to B
    @property
    def area(self) -> NDArray[np.float64]: ...  # (n, m) [u²]
    @property
    def depth(self) -> NDArray[np.float64]: ...  # (n, m) [u]
    @property
    def volume(self) -> NDArray[np.float64]: ...  # (n, m) [u³]
    @property
    def force(self) -> NDArray[np.float64]: ...  # (n, m, 3) [u²]
    @property
    def torque(self) -> NDArray[np.float64]: ...  # (n, m, 3) [u³]
    @property
    def point(self) -> NDArray[np.float64]: ...  # (n, m, 3) [u] on the central axis of the wrench
    @property
    def twist(self) -> NDArray[np.float64]: ...  # (n, m) [u³] about the normal

@final
class OverlapOutline:
    @property
    def contact(self) -> ContactPatches: ...  # of one pose
    @property
    def segments(self) -> NDArray[np.float64]: ...  # (n, 2, 3) [u] from and to, world
    @property
    def patch(self) -> NDArray[np.uint32]: ...  # (n,) the patch that each bounds

@final
class TimeOfImpact:
    @property
    def time(self) -> _Column: ...  # (n,) [T]
    @property
    def distance_min(self) -> _Column: ...  # (n,) [u]
    @property
    def distance_max(self) -> _Column: ...  # (n,) [u]
    @property
    def point_a(self) -> NDArray[np.float64]: ...  # (n, 3) [u]
    @property
    def point_b(self) -> NDArray[np.float64]: ...  # (n, 3) [u]
    @property
    def normal(self) -> NDArray[np.float64]: ...  # (n, 3) unit, from A to B
    @property
    def status(self) -> _Column: ...  # (n,) ImpactStatus
    @property
    def node_visits(self) -> _Column: ...  # (n,)
    @property
    def surface_pairs(self) -> _Column: ...  # (n,)

def penetration(
    a: _Solid, b: _Solid, poses: _Rows, *, scales: _Rows | None = None,
    poses_a: _Rows | None = None, scales_a: _Rows | None = None,
    scale_gradients: bool = False, measure: _Measure = "matched", field: _FieldUse = "automatic",
    pair_budget: int = 0, max_visits: int = 0, relative_error: float = 0.0, pair_id: int = 0,
    threads: int = 0, wanted: Sequence[str] | None = None, out: Any = None, stream: Any = None,
) -> Penetration: ...  # of solids on a GPU gpu.Penetration
def separation(
    a: _Solid, b: _Solid, poses: _Rows, *, scales: _Rows | None = None,
    poses_a: _Rows | None = None, scales_a: _Rows | None = None, max_visits: int = 0,
    inner_spheres: bool = False, threads: int = 0, wanted: Sequence[str] | None = None,
    out: Any = None, stream: Any = None,
) -> Separation: ...  # of solids on a GPU gpu.Separation
def raycast(
    solid: Asset | Field, pose: ArrayLike | None, origins: ArrayLike, directions: ArrayLike, *,
    longest: float = ..., scale: float = 1.0,
) -> RayHits: ...
def closest_point(
    solid: Asset | Field, pose: ArrayLike | None, points: ArrayLike, *, scale: float = 1.0,
) -> SurfacePoints: ...
def contains(
    solid: Asset | Field, pose: ArrayLike | None, points: ArrayLike, *, scale: float = 1.0,
) -> Any: ...  # (n,) uint32, Overlapping
def contact_patches(
    a: _Solid, b: _Solid, poses: _Rows, *, max_patches: int = 8,
    scales: _Rows | None = None, poses_a: _Rows | None = None,
    scales_a: _Rows | None = None, measure: _Measure = "matched",
    field: _FieldUse = "automatic", pair_budget: int = 0, max_visits: int = 0,
    relative_error: float = 0.0, pair_id: int = 0, threads: int = 0, wanted: Sequence[str] | None = None,
    out: Any = None, stream: Any = None,
) -> ContactPatches: ...  # of solids on a GPU gpu.ContactPatches
def overlap_outline(
    a: Asset, b: Asset, poses: ArrayLike, *, max_patches: int = 8,
    scales: ArrayLike | None = None, poses_a: ArrayLike | None = None,
    scales_a: ArrayLike | None = None, max_visits: int = 0, pair_id: int = 0,
) -> OverlapOutline: ...
def overlap(
    a: _Solid, b: _Solid, poses: _Rows, *, scales: ArrayLike | None = None,
    poses_a: ArrayLike | None = None, scales_a: ArrayLike | None = None, threads: int = 0,
) -> Any: ...  # (n,) uint32, Overlapping
def time_of_impact(
    a: _Solid, b: _Solid, poses: ArrayLike, poses_to: ArrayLike, *,
    about: ArrayLike = (0.0, 0.0, 0.0), scales: ArrayLike | None = None,
    poses_a: ArrayLike | None = None, poses_a_to: ArrayLike | None = None,
    about_a: ArrayLike = (0.0, 0.0, 0.0), scales_a: ArrayLike | None = None,
    duration: float = 1.0, tolerance: float = 0.0, max_visits: int = 0, threads: int = 0,
) -> TimeOfImpact: ...
