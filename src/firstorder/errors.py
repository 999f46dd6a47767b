"""The exception by which laws and portraits decline, and the warning that no light can arrive."""

from __future__ import annotations


class Refused(Exception):
    """A law, or a portrait, that declines, with the reason. Never an accident."""

    def __init__(self, reason: str):
        super().__init__(reason)
        self.reason = reason


class NoLight(UserWarning):
    """Light is asked for where none can arrive, so that the answer is zero for a plain reason."""
