"""Types of ist.gpu. Shapes and units: docs/python.md, and help() of every name."""

from typing import Any, final

import numpy as np
from numpy.typing import NDArray

_DeviceArray = Any  # has __dlpack__ and __dlpack_device__, or __cuda_array_interface__

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
class Penetration:
    @property
    def volume(self) -> _DeviceArray | None: ...  # (n,) [u³]
    @property
    def centroid(self) -> _DeviceArray | None: ...  # (n, 3) [u]
    @property
    def force(self) -> _DeviceArray | None: ...  # (n, 3) [u²] on B
    @property
    def torque(self) -> _DeviceArray | None: ...  # (n, 3) [u³] on B, about its origin
    @property
    def status(self) -> _DeviceArray | None: ...  # (n,) QueryStatus
    @property
    def node_visits(self) -> _DeviceArray | None: ...  # (n,)
    @property
    def sphere_pairs(self) -> _DeviceArray | None: ...  # (n,)

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
    def point(self) -> _DeviceArray | None: ...  # (n, m, 3) [u] on the central axis of the wrench
    @property
    def twist(self) -> _DeviceArray | None: ...  # (n, m) [u³] about the normal
    @property
    def status(self) -> _DeviceArray | None: ...  # (n,) QueryStatus
