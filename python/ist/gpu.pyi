"""Types of ist.gpu. Shapes and units: docs/python.md, and help() of every name."""

from typing import Any, Final, final

import numpy as np
from numpy.typing import NDArray

_DeviceArray = Any  # has __dlpack__ and __dlpack_device__, or __cuda_array_interface__

def available(device: int = 0) -> bool: ...
def why_not(device: int = 0) -> str | None: ...

@final
class Array:
    shape: Final[tuple[int, ...]]
    dtype: Final[np.dtype[Any]]
    device: Final[int]
    def __len__(self) -> int: ...
    def __dlpack__(
        self, *, stream: int | None = None, max_version: tuple[int, int] | None = None,
        dl_device: tuple[int, int] | None = None, copy: bool | None = None,
    ) -> Any: ...
    def __dlpack_device__(self) -> tuple[int, int]: ...
    __cuda_array_interface__: Final[dict[str, Any]]
    def numpy(self) -> NDArray[Any]: ...  # a copy on the host

@final
class Penetration:
    volume: Final[_DeviceArray | None]  # (n,) [u³]
    centroid: Final[_DeviceArray | None]  # (n, 3) [u]
    force: Final[_DeviceArray | None]  # (n, 3) [u²] on B
    torque: Final[_DeviceArray | None]  # (n, 3) [u³] on B, about its origin
    status: Final[_DeviceArray | None]  # (n,) QueryStatus
    node_visits: Final[_DeviceArray | None]  # (n,)
    sphere_pairs: Final[_DeviceArray | None]  # (n,)
    volume_min: Final[_DeviceArray | None]  # (n,) [u³] of the true volume; by spheres: the volume
    volume_max: Final[_DeviceArray | None]  # (n,) [u³]
    contact_area: Final[_DeviceArray | None]  # (n,) [u²] exact, where they touch: of faces on each other
    contact_normal: Final[_DeviceArray | None]  # (n, 3) unit, from A to B; zero without faces
    touching: Final[_DeviceArray | None]  # (n,) bool, exact: they meet and the volume is 0

@final
class Separation:
    distance: Final[_DeviceArray | None]  # (n,) [u]
    distance_min: Final[_DeviceArray | None]  # (n,) [u] certified
    distance_max: Final[_DeviceArray | None]  # (n,) [u] certified
    point_a: Final[_DeviceArray | None]  # (n, 3) [u]
    point_b: Final[_DeviceArray | None]  # (n, 3) [u]
    normal: Final[_DeviceArray | None]  # (n, 3) unit, from A to B
    status: Final[_DeviceArray | None]  # (n,) QueryStatus
    node_visits: Final[_DeviceArray | None]  # (n,)
    sphere_pairs: Final[_DeviceArray | None]  # (n,)

@final
class ContactPatches:
    count: Final[_DeviceArray | None]  # (n,)
    id: Final[_DeviceArray | None]  # (n, m) uint64
    centroid: Final[_DeviceArray | None]  # (n, m, 3) [u]
    normal: Final[_DeviceArray | None]  # (n, m, 3) unit, from A to B
    area: Final[_DeviceArray | None]  # (n, m) [u²]
    depth: Final[_DeviceArray | None]  # (n, m) [u]
    volume: Final[_DeviceArray | None]  # (n, m) [u³]
    force: Final[_DeviceArray | None]  # (n, m, 3) [u²]
    torque: Final[_DeviceArray | None]  # (n, m, 3) [u³/rad]
    point: Final[_DeviceArray | None]  # (n, m, 3) [u] on the central axis of the wrench
    torsion: Final[_DeviceArray | None]  # (n, m) [u³] about the normal
    status: Final[_DeviceArray | None]  # (n,) QueryStatus

@final
class ScenePairs:
    count: Final[Array]  # (1,) pairs; 0 if they are more than max_pairs
    boxes_met: Final[Array]  # (1,)
    a: Final[Array]  # (max_pairs,) body
    b: Final[Array]  # (max_pairs,) body, above a's
    solid_a: Final[Array]  # (max_pairs,)
    solid_b: Final[Array]  # (max_pairs,)
    poses_a: Final[Array]  # (max_pairs, 7)
    poses: Final[Array]  # (max_pairs, 7) of b
    scales_a: Final[Array]  # (max_pairs,)
    scales: Final[Array]  # (max_pairs,) of b
    status: Final[Array]  # (n,) QueryStatus of each body

@final
class Scene:
    bytes: Final[int]
    def __init__(
        self, solids: Any, solid: Any, *, scales: Any = None, worlds: Any = None, moves: Any = None,
        layers: Any = None, meets: Any = None, excluded: Any = None, margin: float = 0.0,
        max_pairs: int = 8192, measure: str = "matched",
    ) -> None: ...
    def __len__(self) -> int: ...
    def find_pairs(self, poses: _DeviceArray, *, stream: Any = None) -> ScenePairs: ...
