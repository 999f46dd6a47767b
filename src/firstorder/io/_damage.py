"""Damaged files: set aside under another name, never lost, and named in one sentence."""

from __future__ import annotations

import contextlib
import itertools
import pathlib


def set_aside(file: pathlib.Path, reason: str) -> str:
    """Renames a damaged file, so that it can be made anew; what was set aside before stays.

    Args:
        file: that is damaged.
        reason: why, in words.

    Returns:
        A sentence about it.

    Example:
        >>> import pathlib, tempfile
        >>> from firstorder.io._damage import set_aside
        >>> file = pathlib.Path(tempfile.mkdtemp(), "a.npz")
        >>> file.touch()
        >>> set_aside(file, "it is empty")
        'a.npz is damaged (it is empty): it is kept as a.npz.damaged and made anew.'
    """
    names = itertools.chain([".damaged"], (f".damaged{k}" for k in itertools.count(2)))
    others = (file.with_name(file.name + name) for name in names)
    other = next(other for other in others if not other.exists())
    with contextlib.suppress(FileNotFoundError):  # another program was quicker
        file.rename(other)
    return f"{file.name} is damaged ({reason}): it is kept as {other.name} and made anew."
