"""The exception by which laws and portraits decline."""

from __future__ import annotations


class Refused(Exception):
    """A law, or a portrait, that declines, with the reason. Never an accident."""

    def __init__(self, reason: str):
        super().__init__(reason)
        self.reason = reason
