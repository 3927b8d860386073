"""Types of package ist. Shapes, units and frames: docs/python.md, and help() of every name.

[u] is the meshes' own unit; poses are rows qw, qx, qy, qz, tx, ty, tz. For a single pose, columns
have no leading n: numbers and (3,) arrays.
"""

import enum
import os
from collections.abc import Callable, Sequence
from typing import Any, Final, Literal, Protocol, final

import numpy as np
from numpy.typing import ArrayLike, NDArray

from . import gpu as gpu

__version__: str

_Path = str | os.PathLike[str]
# One row a pose. For a single pose a number, which has the methods of a NumPy scalar's type.
_Column = NDArray[np.float64]
_Count = NDArray[np.uint32]
_SphereMeasure = Literal["matched", "inner"]
_Measure = Literal["matched", "inner", "exact"]
_Grid = Literal["banded", "uniform", "explicit", "implicit", "hybrid"]
_Scale = float | ArrayLike  # a factor, or (3,) of each axis
_Device = Literal["auto", "cpu", "cuda"]

class Error(RuntimeError): ...
class OpenMeshError(Error): ...

class QueryStatus(enum.IntEnum):
    ok = 0
    budget_exhausted = 1
    invalid_input = 2
    missing_data = 3
    error_exceeded = 4

class YesNo(enum.IntEnum):
    no = 0
    yes = 1
    unknown = 2

class ImpactKind(enum.IntEnum):
    no_impact = 0
    impact = 1
    unresolved = 2
    overlapping = 3

@final
class Progress:
    total: Final[float]  # [0, 1]
    stage: Final[str]
    spheres: Final[int]
    coverage: Final[float]  # [0, 1]
    radius: Final[float]  # [u]
    fraction: Final[float]  # [0, 1]
    elapsed: Final[float]  # [s]

@final
class MeshReport:
    vertices: Final[int]
    triangles: Final[int]
    components: Final[int]
    boundary_edges: Final[int]
    nonmanifold_edges: Final[int]
    flipped_components: Final[int]
    degenerate_triangles: Final[int]
    self_intersections: Final[int]
    shells: Final[int]
    meets_itself: Final[bool]
    filled_holes: Final[int]
    repaired: Final[bool]
    volume: Final[float]  # [u³]
    notes: Final[list[str]]

@final
class Mesh:
    def __init__(self, vertices: ArrayLike, triangles: ArrayLike) -> None: ...
    vertices: Final[NDArray[np.float64]]  # (n, 3) [u], read-only view
    triangles: Final[NDArray[np.uint32]]  # (m, 3), read-only view
    declared_up_axis: Final[Literal["X", "Y", "Z"] | None]
    declared_unit: Final[float]  # [m]
    notes: Final[list[str]]

_Drawn = Asset | Mesh | ClosedMesh

class _MeshLike(Protocol):
    """trimesh.Trimesh, and the like."""

    vertices: Any  # (n, 3) [u]
    faces: Any  # (m, 3)

_OpenMesh = Mesh | _Path | tuple[ArrayLike, ArrayLike] | _MeshLike

@final
class ClosedMesh:
    vertices: Final[NDArray[np.float64]]  # (n, 3) [u], read-only view
    triangles: Final[NDArray[np.uint32]]  # (m, 3), read-only view
    name: Final[str]
    report: Final[MeshReport]

def load_mesh(path: _Path, *, weld_tolerance: float = 0.0) -> Mesh: ...
def from_trimesh(mesh: _MeshLike) -> Mesh: ...
def close_mesh(
    mesh: _OpenMesh, *, name: str = "mesh", repair: bool = False, scale: _Scale = 1.0,
) -> ClosedMesh: ...
def sample_mesh(name: str) -> Mesh: ...
def clash(
    meshes: Sequence[Asset | ClosedMesh | _OpenMesh], poses: ArrayLike | None = None, *,
    names: Sequence[str] | None = None, scales: ArrayLike | None = None, clearance: float = 0.0,
    tolerance: float | None = None, touch_within: float | None = None, threads: int = 0,
) -> dict[str, Any]: ...

@final
class MassProperties:
    volume: Final[float]  # [u³]
    centre_of_mass: Final[NDArray[np.float64]]  # (3,) [u]
    inertia: Final[NDArray[np.float64]]  # (3, 3) [u⁵]
    volume_error: Final[float]  # [u³]
    centre_of_mass_error: Final[float]  # [u]
    inertia_error: Final[float]  # [u⁵]

@final
class Bounds:
    lower: Final[NDArray[np.float64]]  # (3,) [u]
    upper: Final[NDArray[np.float64]]  # (3,) [u]
    centre: Final[NDArray[np.float64]]  # (3,) [u]
    radius: Final[float]  # [u]

@final
class Invariant:
    name: Final[str]
    worst: Final[float]
    meaning: Final[str]
    where: Final[int]
    checked: Final[int]
    violations: Final[int]

@final
class PartnerError:
    partner: Final[str]
    median: Final[float]
    poses: Final[int]

@final
class TargetedAsset:
    asset: Final[Asset]
    measured_error: Final[float]
    poses: Final[int]
    partners: Final[list[PartnerError]]
    met: Final[bool]
    stop: Final[str]

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
    def mesh(self) -> tuple[NDArray[np.float64], NDArray[np.uint32]]: ...
    def spheres(self, which: _SphereMeasure = "matched") -> NDArray[np.float64]: ...  # (n, 4) [u]
    def mass_properties(self, pose: ArrayLike | None = None, scale: float = 1.0) -> MassProperties: ...
    def bounds(self, pose: ArrayLike | None = None, scale: float = 1.0) -> Bounds: ...
    sphere_count: Final[int]
    volume: Final[float]  # [u³]
    coverage: Final[float]  # [0, 1]
    protrusion: Final[float]  # [u]
    mesh_triangles: Final[int]  # 0: it holds no mesh
    mesh_error: Final[float]  # [u]
    mesh_state: Final[Literal["none", "own", "resolved", "polygonised", "unresolved"]]
    self_overlap_volume: Final[float]  # [u³]

def bake(
    mesh: ClosedMesh | _OpenMesh, *, max_spheres: int = 10000, target_coverage: float = 1.0,
    min_radius: float = 0.0, time_limit: float = 0.0, epsilon: float = 0.0, grid: _Grid = "banded",
    seed: int = 0, threads: int = 0, device: _Device = "auto", keep_mesh: bool = True,
    scale: _Scale = 1.0, progress: Callable[[Progress], Any] | None = None,
) -> Asset: ...
def bake_mesh_only(
    mesh: ClosedMesh | _OpenMesh, *, scale: _Scale = 1.0,
    threads: int = 0, progress: Callable[[Progress], Any] | None = None,
) -> Asset: ...
def bake_to_error(
    mesh: ClosedMesh | _OpenMesh, relative_error: float = 0.01, at_overlap: float = 0.001, *,
    max_spheres: int = 0, target_coverage: float = 1.0, min_radius: float = 0.0,
    time_limit: float = 0.0, epsilon: float = 0.0, grid: _Grid = "banded", seed: int = 0,
    threads: int = 0, device: _Device = "auto", keep_mesh: bool = True,
    scale: _Scale = 1.0, progress: Callable[[Progress], Any] | None = None,
) -> TargetedAsset: ...
def check(
    asset: Asset, mesh: ClosedMesh | _OpenMesh, *, scale: _Scale = 1.0, threads: int = 0,
) -> list[Invariant]: ...

class Shape: ...

@final
class HalfSpaceShape(Shape):
    def __init__(self, normal: ArrayLike = (0.0, 0.0, 1.0), offset: float = 0.0) -> None: ...

@final
class BoxShape(Shape):
    def __init__(self, half_extents: ArrayLike) -> None: ...

@final
class BallShape(Shape):
    def __init__(self, radius: float) -> None: ...

@final
class CapsuleShape(Shape):
    def __init__(self, radius: float, half_height: float) -> None: ...

@final
class CylinderShape(Shape):
    def __init__(self, radius: float, half_height: float) -> None: ...

@final
class HeightFieldShape(Shape):
    def __init__(
        self, heights: ArrayLike, *, spacing: ArrayLike = (1.0, 1.0), lowest: float = -1e300,
        highest: float = 1e300,
    ) -> None: ...

@final
class DistanceGridShape(Shape):
    def __init__(
        self, distances: ArrayLike, *, origin: ArrayLike, spacing: float, error: float = 0.0
    ) -> None: ...

@final
class SolidRows: ...

@final
class Solids:
    def __init__(
        self, solids: Sequence[Asset | Shape], *, device: Any = "cpu",
    ) -> None: ...  # "cpu", "cuda", "cuda:1", a torch.device
    def __len__(self) -> int: ...
    def __getitem__(self, index: int | _Rows) -> SolidRows: ...  # or (n,) indices, or a slice
    device: Final[str]
    shapes: Final[list[int]]
    bytes: Final[int]  # of device memory

_Solid = Asset | Shape | SolidRows
_Rows = Any  # ArrayLike; of solids on a GPU an array of any framework in its memory

@final
class Penetration:
    def __len__(self) -> int: ...  # rows
    def __getitem__(self, index: Any) -> Penetration: ...  # a row, or some
    volume: Final[_Column]  # (n,) [u³]
    volume_min: Final[_Column]  # (n,) [u³] exact: the true volume is at least this; else the sum's interval
    volume_max: Final[_Column]  # (n,) [u³] and at most this
    centroid: Final[NDArray[np.float64]]  # (n, 3) [u]
    force: Final[NDArray[np.float64]]  # (n, 3) [u²] on B
    torque: Final[NDArray[np.float64]]  # (n, 3) [u³] on B, about its origin
    pose_gradient: Final[NDArray[np.float64]]  # (n, 7) dV/d(pose of B)
    pose_gradient_a: Final[NDArray[np.float64]]  # (n, 7) dV/d(pose of A)
    scale_gradient: Final[_Column | None]  # (n,) [u³] dV/d(scale of B)
    scale_gradient_a: Final[_Column | None]  # (n,) [u³] dV/d(scale of A)
    touching: Final[NDArray[np.bool_] | bool]  # (n,) exact: they meet and the volume is 0
    contact_area: Final[_Column]  # (n,) [u²] of faces that lie on each other
    contact_normal: Final[NDArray[np.float64]]  # (n, 3) from A to B
    status: Final[_Count]  # (n,) QueryStatus
    node_visits: Final[_Count]  # (n,)
    sphere_pairs: Final[_Count]  # (n,)

@final
class SceneStep:
    def __len__(self) -> int: ...  # pairs
    pairs: Final[NDArray[np.uint32]]  # (n, 2) numbers of the bodies that meet
    begins: Final[NDArray[np.bool_]]  # (n,) they did not meet in the step before
    overlapping: Final[NDArray[np.uint32]]  # (n,) YesNo, where the rule is 'overlap'
    penetration: Final[Penetration]  # n rows
    separation: Final[Separation]  # n rows
    impact: Final[TimeOfImpact]  # n rows, where the rule is 'impact'
    ended: Final[NDArray[np.uint32]]  # (m, 2)
    refused: Final[NDArray[np.uint32]]  # (k,)

@final
class SceneHits:
    number: Final[_Count]  # (n,) of the body; 0 without a hit
    hit: Final[RayHits]  # n rows

@final
class ScenePoints:
    number: Final[_Count]  # (n,) of the body; 0 where none is near enough
    surface: Final[SurfacePoints]  # n rows; distance inf where none is near enough

class Scene:
    def __init__(
        self, *, max_bodies: int = 1024, max_pairs: int = 8192, threads: int = 0,
    ) -> None: ...
    def __len__(self) -> int: ...
    def add(
        self, solid: Asset | Shape, pose: ArrayLike | None = None, *, scale: float = 1.0,
        number: int | None = None, moves: bool = True, group: int = 0, layers: int = 1,
        meets: int = 0xFFFFFFFF,
    ) -> int: ...
    def remove(self, number: int) -> None: ...
    def set_rule(
        self, group_a: int = 0, group_b: int = 0, *,
        answer: Literal["nothing", "boxes", "overlap", "penetration", "impact"] = "penetration",
        measure: _Measure = "matched",
        spheres_only: bool = False, margin: float = 0.0,
        pair_budget: int = 0, max_visits: int = 0, relative_error: float = 0.0,
        duration: float = 1.0, tolerance: float = 0.0,
    ) -> None: ...
    def set_motions(
        self, velocities: ArrayLike, *, numbers: ArrayLike | None = None,
        about: ArrayLike = (0.0, 0.0, 0.0),
    ) -> None: ...
    def raycast(
        self, origins: ArrayLike, directions: ArrayLike, *, max_distance: float = ...,
    ) -> SceneHits: ...
    def nearest(self, points: ArrayLike, *, max_distance: float = ...) -> ScenePoints: ...
    def in_box(self, lower: ArrayLike, upper: ArrayLike) -> NDArray[np.uint32]: ...
    def exclude(self, a: int, b: int) -> None: ...
    def include(self, a: int, b: int) -> None: ...
    def record(self) -> bytes: ...
    @staticmethod
    def replay(record: bytes, assets: Sequence[Asset], *, threads: int = 0) -> Scene: ...
    def step(
        self, poses: ArrayLike | None = None, *, numbers: ArrayLike | None = None,
    ) -> SceneStep: ...

@final
class Lenses:
    centre: Final[NDArray[np.float64]]  # (n, 3) [u] world
    axis: Final[NDArray[np.float64]]  # (n, 3) unit, from A's sphere to B's
    radius: Final[NDArray[np.float64]]  # (n,) [u]
    thickness: Final[NDArray[np.float64]]  # (n,) [u]
    sphere_a: Final[NDArray[np.uint32]]  # (n,)
    sphere_b: Final[NDArray[np.uint32]]  # (n,)

@final
class SizeMatch:
    feature_size_a: Final[float]  # [u]
    feature_size_b: Final[float]  # [u]
    ratio: Final[float]  # ≥ 1
    a_is_coarser: Final[bool]
    has_mesh: Final[bool]
    needs_mesh: Final[bool]
    fits: Final[bool]

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
def size_match(a: Asset, b: Asset, *, scale: float = 1.0, scale_a: float = 1.0) -> SizeMatch: ...

@final
class RayHits:
    def __len__(self) -> int: ...  # rows
    def __getitem__(self, index: Any) -> RayHits: ...  # a row, or some
    distance: Final[_Column]  # (n,) [u] inf: no hit
    point: Final[NDArray[np.float64]]  # (n, 3) [u] world
    normal: Final[NDArray[np.float64]]  # (n, 3) unit, outward
    triangle: Final[_Count]  # (n,)
    status: Final[_Count]  # (n,) QueryStatus

@final
class SurfacePoints:
    def __len__(self) -> int: ...  # rows
    def __getitem__(self, index: Any) -> SurfacePoints: ...  # a row, or some
    distance: Final[_Column]  # (n,) [u] < 0 inside
    error: Final[_Column]  # (n,) [u]
    point: Final[NDArray[np.float64]]  # (n, 3) [u] world
    gradient: Final[NDArray[np.float64]]  # (n, 3) unit, outward
    triangle: Final[_Count]  # (n,)
    status: Final[_Count]  # (n,) QueryStatus

@final
class Separation:
    def __len__(self) -> int: ...  # rows
    def __getitem__(self, index: Any) -> Separation: ...  # a row, or some
    distance: Final[_Column]  # (n,) [u]
    distance_min: Final[_Column]  # (n,) [u] certified
    distance_max: Final[_Column]  # (n,) [u] certified
    point_a: Final[NDArray[np.float64]]  # (n, 3) [u] world
    point_b: Final[NDArray[np.float64]]  # (n, 3) [u] world
    normal: Final[NDArray[np.float64]]  # (n, 3) unit, from A to B
    status: Final[_Count]  # (n,) QueryStatus
    node_visits: Final[_Count]  # (n,)
    sphere_pairs: Final[_Count]  # (n,)

@final
class ContactPatches:
    def __len__(self) -> int: ...  # rows
    def __getitem__(self, index: Any) -> ContactPatches: ...  # a row, or some
    penetration: Final[Penetration]
    status: Final[_Count]  # (n,) QueryStatus
    count: Final[_Count]  # (n,)
    id: Final[NDArray[np.uint64]]  # (n, m)
    centroid: Final[NDArray[np.float64]]  # (n, m, 3) [u]
    normal: Final[NDArray[np.float64]]  # (n, m, 3) unit, from A to B
    area: Final[NDArray[np.float64]]  # (n, m) [u²]
    depth: Final[NDArray[np.float64]]  # (n, m) [u]
    volume: Final[NDArray[np.float64]]  # (n, m) [u³]
    force: Final[NDArray[np.float64]]  # (n, m, 3) [u²]
    torque: Final[NDArray[np.float64]]  # (n, m, 3) [u³]
    point: Final[NDArray[np.float64]]  # (n, m, 3) [u] on the central axis of the wrench
    torsion: Final[NDArray[np.float64]]  # (n, m) [u³] about the normal

@final
class OverlapOutline:
    contact: Final[ContactPatches]  # of one pose
    segments: Final[NDArray[np.float64]]  # (n, 2, 3) [u] from and to, world
    patch: Final[NDArray[np.uint32]]  # (n,) the patch that each bounds

@final
class TimeOfImpact:
    def __len__(self) -> int: ...  # rows
    def __getitem__(self, index: Any) -> TimeOfImpact: ...  # a row, or some
    time: Final[_Column]  # (n,) [T]
    distance_min: Final[_Column]  # (n,) [u]
    distance_max: Final[_Column]  # (n,) [u]
    point_a: Final[NDArray[np.float64]]  # (n, 3) [u]
    point_b: Final[NDArray[np.float64]]  # (n, 3) [u]
    normal: Final[NDArray[np.float64]]  # (n, 3) unit, from A to B
    kind: Final[_Count]  # (n,) ImpactKind
    status: Final[_Count]  # (n,) QueryStatus
    node_visits: Final[_Count]  # (n,)
    surface_pairs: Final[_Count]  # (n,)

def penetration(
    a: _Solid, b: _Solid, poses: _Rows, *, scales: _Rows | None = None,
    poses_a: _Rows | None = None, scales_a: _Rows | None = None,
    scale_gradients: bool = False, measure: _Measure = "matched", spheres_only: bool = False,
    pair_budget: int = 0, max_visits: int = 0, relative_error: float = 0.0, pair_id: int = 0,
    threads: int = 0, wanted: Sequence[str] | None = None, out: Any = None, stream: Any = None,
) -> Penetration: ...  # of solids on a GPU gpu.Penetration
def separation(
    a: _Solid, b: _Solid, poses: _Rows, *, scales: _Rows | None = None,
    poses_a: _Rows | None = None, scales_a: _Rows | None = None, max_visits: int = 0,
    inner_spheres: bool | None = None, max_distance: float = 0.0, pair_id: int = 0,
    threads: int = 0, wanted: Sequence[str] | None = None,
    out: Any = None, stream: Any = None,
) -> Separation: ...  # of solids on a GPU gpu.Separation
def raycast(
    solid: Asset | Shape, pose: ArrayLike | None, origins: ArrayLike, directions: ArrayLike, *,
    max_distance: float = ..., scale: float = 1.0,
) -> RayHits: ...
def closest_point(
    solid: Asset | Shape, pose: ArrayLike | None, points: ArrayLike, *, scale: float = 1.0,
) -> SurfacePoints: ...
def contains(
    solid: Asset | Shape, pose: ArrayLike | None, points: ArrayLike, *, scale: float = 1.0,
) -> _Count: ...  # (n,) of YesNo; one for one pose
def contact_patches(
    a: _Solid, b: _Solid, poses: _Rows, *, scales: _Rows | None = None,
    poses_a: _Rows | None = None, scales_a: _Rows | None = None,
    max_patches: int = 8, measure: _Measure = "matched", spheres_only: bool = False,
    pair_budget: int = 0, max_visits: int = 0, relative_error: float = 0.0, pair_id: int = 0,
    threads: int = 0, wanted: Sequence[str] | None = None, out: Any = None, stream: Any = None,
) -> ContactPatches: ...  # of solids on a GPU gpu.ContactPatches
def overlap_outline(
    a: Asset, b: Asset, poses: ArrayLike, *, scales: ArrayLike | None = None,
    poses_a: ArrayLike | None = None, scales_a: ArrayLike | None = None,
    max_patches: int = 8, max_visits: int = 0, pair_id: int = 0,
) -> OverlapOutline: ...
def overlap(
    a: _Solid, b: _Solid, poses: _Rows, *, scales: ArrayLike | None = None,
    poses_a: ArrayLike | None = None, scales_a: ArrayLike | None = None, margin: float = 0.0,
    threads: int = 0,
) -> _Count: ...  # (n,) of YesNo; one for one pose
def time_of_impact(
    a: _Solid, b: _Solid, poses: ArrayLike, poses_to: ArrayLike, *,
    about: ArrayLike = (0.0, 0.0, 0.0), scales: ArrayLike | None = None,
    poses_a: ArrayLike | None = None, poses_a_to: ArrayLike | None = None,
    about_a: ArrayLike = (0.0, 0.0, 0.0), scales_a: ArrayLike | None = None,
    duration: float = 1.0, tolerance: float = 0.0, max_visits: int = 0, threads: int = 0,
) -> TimeOfImpact: ...
