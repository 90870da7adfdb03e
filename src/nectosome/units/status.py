"""Statuses: numbers that arrays and files hold, each with its reason in words."""

from enum import IntEnum
from typing import Self


class ReasonedStatus(IntEnum):
    """A status, which is its value as an integer; a member is defined by its value and its `reason`."""

    reason: str

    def __new__(cls, value: int, reason: str) -> Self:
        """A member of its value and its reason."""
        member = int.__new__(cls, value)
        member._value_, member.reason = value, reason
        return member

    def __str__(self) -> str:
        return self.name

    def __repr__(self) -> str:
        return f"<{type(self).__name__}.{self.name}: {self.reason}>"
