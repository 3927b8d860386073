"""Types of ist.gpu. Shapes and units: docs/python.md, and help() of every name."""

from collections.abc import Mapping, Sequence
from typing import Any, Literal, final

import numpy as np
from numpy.typing import NDArray

from . import Asset, Field

_DeviceArray = Any  # has __dlpack__ and __dlpack_device__, or __cuda_array_interface__
_Stream = Any  # a handle, or has __cuda_stream__, cuda_stream or ptr
_Answer = Literal[
    "volume", "centroid", "translation_gradient", "rotation_gradient", "status", "node_visits",
    "sphere_pairs",
]

def available(device: int = 0) -> bool: ...
def why_not(device: int = 0) -> str | None: ...

@final
class Array:
    @property
    def shape(self) -> tuple[int, ...]: ...
    @property
    def dtype(self) -> np.dtype[Any]: ...
    @property
    def device(self) -> int: ...
    def __len__(self) -> int: ...
    def __dlpack__(
        self, *, stream: int | None = None, max_version: tuple[int, int] | None = None,
        dl_device: tuple[int, int] | None = None, copy: bool | None = None,
    ) -> Any: ...
    def __dlpack_device__(self) -> tuple[int, int]: ...
    @property
    def __cuda_array_interface__(self) -> dict[str, Any]: ...
    def numpy(self) -> NDArray[Any]: ...  # a copy on the host

@final
class Solids:
    def __init__(self, solids: Sequence[Asset | Field], *, device: int = 0) -> None: ...
    def __len__(self) -> int: ...
    @property
    def device(self) -> int: ...
    @property
    def bytes(self) -> int: ...

@final
class Penetration:
    @property
    def volume(self) -> _DeviceArray | None: ...  # (n,) [u³]
    @property
    def centroid(self) -> _DeviceArray | None: ...  # (n, 3) [u]
    @property
    def translation_gradient(self) -> _DeviceArray | None: ...  # (n, 3) [u²] of B
    @property
    def rotation_gradient(self) -> _DeviceArray | None: ...  # (n, 3) [u³/rad] of B
    @property
    def status(self) -> _DeviceArray | None: ...  # (n,) QueryStatus
    @property
    def node_visits(self) -> _DeviceArray | None: ...  # (n,)
    @property
    def sphere_pairs(self) -> _DeviceArray | None: ...  # (n,)

def penetration(
    solids: Solids, solid_a: _DeviceArray | int, solid_b: _DeviceArray | int,
    pose_a: _DeviceArray | None, pose_b: _DeviceArray | None, scale_a: _DeviceArray | None = None,
    scale_b: _DeviceArray | None = None, *,
    measure: Literal["matched", "inner"] = "matched", pair_budget: int = 0,
    wanted: Sequence[_Answer] | None = None,
    out: Mapping[_Answer, _DeviceArray] | Penetration | None = None, stream: _Stream = None,
) -> Penetration: ...

@final
class Separation:
    @property
    def distance(self) -> _DeviceArray | None: ...  # (n,) [u]
    @property
    def distance_min(self) -> _DeviceArray | None: ...  # (n,) [u] certified
    @property
    def distance_max(self) -> _DeviceArray | None: ...  # (n,) [u] certified
    @property
    def point_a(self) -> _DeviceArray | None: ...  # (n, 3) [u]
    @property
    def point_b(self) -> _DeviceArray | None: ...  # (n, 3) [u]
    @property
    def normal(self) -> _DeviceArray | None: ...  # (n, 3) unit, from A to B
    @property
    def status(self) -> _DeviceArray | None: ...  # (n,) QueryStatus
    @property
    def node_visits(self) -> _DeviceArray | None: ...  # (n,)
    @property
    def sphere_pairs(self) -> _DeviceArray | None: ...  # (n,)

_Gap = Literal[
    "distance", "distance_min", "distance_max", "point_a", "point_b", "normal", "status",
    "node_visits", "sphere_pairs",
]

def separation(
    solids: Solids, solid_a: _DeviceArray | int, solid_b: _DeviceArray | int,
    pose_a: _DeviceArray | None, pose_b: _DeviceArray | None, scale_a: _DeviceArray | None = None,
    scale_b: _DeviceArray | None = None, *, max_visits: int = 0,
    wanted: Sequence[_Gap] | None = None,
    out: Mapping[_Gap, _DeviceArray] | Separation | None = None, stream: _Stream = None,
) -> Separation: ...

@final
class ContactPatches:
    @property
    def count(self) -> _DeviceArray | None: ...  # (n,)
    @property
    def id(self) -> _DeviceArray | None: ...  # (n, m) uint64
    @property
    def centroid(self) -> _DeviceArray | None: ...  # (n, m, 3) [u]
    @property
    def normal(self) -> _DeviceArray | None: ...  # (n, m, 3) unit, from A to B
    @property
    def area(self) -> _DeviceArray | None: ...  # (n, m) [u²]
    @property
    def depth(self) -> _DeviceArray | None: ...  # (n, m) [u]
    @property
    def volume(self) -> _DeviceArray | None: ...  # (n, m) [u³]
    @property
    def force(self) -> _DeviceArray | None: ...  # (n, m, 3) [u²]
    @property
    def torque(self) -> _DeviceArray | None: ...  # (n, m, 3) [u³/rad]
    @property
    def status(self) -> _DeviceArray | None: ...  # (n,) QueryStatus

_Patch = Literal[
    "count", "id", "centroid", "normal", "area", "depth", "volume", "force", "torque", "status",
]

def contact_patches(
    solids: Solids, solid_a: _DeviceArray | int, solid_b: _DeviceArray | int,
    pose_a: _DeviceArray | None, pose_b: _DeviceArray | None, scale_a: _DeviceArray | None = None,
    scale_b: _DeviceArray | None = None, *, max_patches: int = 8,
    measure: Literal["matched", "inner"] = "matched", wanted: Sequence[_Patch] | None = None,
    out: Mapping[_Patch, _DeviceArray] | ContactPatches | None = None, stream: _Stream = None,
) -> ContactPatches: ...
