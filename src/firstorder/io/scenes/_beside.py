"""Files that a scene names: they lie below the scene's folder, unless the caller allows others.

A scene may come from somebody else. What it names is opened, and what is in it is seen in the
light that is computed: so it chooses among the files beside it, and not among all of the machine.
"""

from __future__ import annotations

import contextlib
import dataclasses
import os
import pathlib

from firstorder.io._regular import check_regular_file


@dataclasses.dataclass(frozen=True)
class Beside:
    """The folder of a scene, and whether what it names may lie elsewhere.

    Attributes:
        folder: of the scene.
        outside: whether files outside of the folder are read too.
    """

    folder: str | os.PathLike[str] = "."
    outside: bool = False

    def file(self, name: str) -> pathlib.Path:
        """The path of a regular file that the scene names.

        Links are followed, and `..` is taken out, before it is judged where the file lies.

        Args:
            name: as the scene has it, from its folder on.

        Raises:
            ValueError: if the file lies outside of the folder and must not, is no regular file, or
                cannot be one.

        Example:
            >>> from firstorder.io.scenes._beside import Beside
            >>> Beside("scenes").file("../keys.txt")
            Traceback (most recent call last):
            ValueError: Argument `file` must lie below the scene's folder, but '../keys.txt' does \
not: `outside=True` (`--outside`) allows it.
        """
        path = pathlib.Path(self.folder, name)
        shown = repr(name) if len(name) <= 40 else repr(name[:37] + "...")
        try:
            inside = path.resolve().is_relative_to(pathlib.Path(self.folder).resolve())
        except (ValueError, OSError, RuntimeError):  # a zero byte, links in a circle
            raise ValueError(f"{shown} is no name of a file.") from None
        if not (inside or self.outside):
            raise ValueError(
                f"Argument `file` must lie below the scene's folder, but {shown} does not: "
                "`outside=True` (`--outside`) allows it."
            )
        with contextlib.suppress(OSError):  # the reader of such files says that there is none
            check_regular_file(path)
        return path
