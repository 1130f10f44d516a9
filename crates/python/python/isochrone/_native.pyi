"""The part of the package that is not Python."""

from typing import Any, Callable, Final, Optional, Sequence, final

import numpy as np
import numpy.typing as npt

from isochrone.frame import Layout
from isochrone.member import Member

__all__ = [
    "Client",
    "FrameReader",
    "FrameWriter",
    "Lent",
    "Pace",
    "__version__",
    "duration_ns",
    "now_ns",
    "read",
    "simulate",
    "trace",
]

__version__: Final[str]

_Given = tuple[npt.NDArray[np.float64], Layout, Sequence[int]]

@final
class Client:
    def __new__(cls, member: Member, node: str, patience_s: float, acts: bool) -> Client: ...
    def call(self, method: str, params: str) -> str: ...
    @staticmethod
    def changes(method: str) -> bool: ...
    def close(self) -> None: ...

@final
class FrameReader:
    def __new__(
        cls,
        member: Member,
        service: str,
        names: Sequence[str],
        layout: Callable[[dict[str, Any]], Layout],
    ) -> FrameReader: ...
    def wait(self, timeout: Optional[float]) -> Optional[_Given]: ...
    def newest(self) -> Optional[_Given]: ...
    def lend(self, timeout: Optional[float]) -> Optional[_Given]: ...
    @property
    def is_lent(self) -> bool: ...
    def close(self) -> None: ...

@final
class FrameWriter:
    def __new__(
        cls,
        member: Member,
        service: str,
        signals: Sequence[tuple[str, ...]],
        period_ns: Optional[int],
        publisher: str,
    ) -> FrameWriter: ...
    def send(
        self,
        values: npt.NDArray[np.float64],
        flags: int,
        cycle: int,
        release_ns: int,
        source_ns: int,
        missed: int,
    ) -> int: ...
    @property
    def readers(self) -> int: ...
    def close(self) -> bool: ...

@final
class Lent: ...

@final
class Pace:
    def __new__(cls, period_ns: int, phase_ns: int) -> Pace: ...
    def wait(self) -> tuple[int, int, int, int]: ...

def duration_ns(text: str) -> int: ...
def now_ns() -> int: ...
def read(path: str) -> tuple[list[dict[str, Any]], Optional[str]]: ...
def simulate(
    path: str,
    text: Optional[str],
    inputs: Sequence[tuple[str, npt.NDArray[np.float64]]],
    cycles: Optional[int],
    task: Optional[str],
    signals: Sequence[str],
) -> tuple[int, dict[str, npt.NDArray[np.float64]], list[str]]: ...
def trace(
    member: Member,
    node: str,
    names: Sequence[str],
    cycles: Optional[int],
    seconds: Optional[float],
    patience_s: float,
) -> dict[str, Any]: ...
