"""What a ``with`` closes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from types import TracebackType
from typing import Optional, TypeVar

Own = TypeVar("Own", bound="Closing")


class Closing(ABC):
    """Something that is closed at the end of a ``with``."""

    @abstractmethod
    def close(self) -> None:
        """Ends it. Further calls do nothing."""

    def __enter__(self: Own) -> Own:
        return self

    def __exit__(
        self,
        kind: Optional[type[BaseException]],
        error: Optional[BaseException],
        trace: Optional[TracebackType],
    ) -> None:
        self.close()
