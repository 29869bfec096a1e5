"""Build in a temporary folder, so that each build contains only the present files of the clone.

By default, setuptools keeps the files of each build in the folder build/lib of the clone. The next wheel then
also contains files that were deleted in the meantime, and two builds at the same time disturb each other.
"""

from __future__ import annotations

from functools import cache
from tempfile import TemporaryDirectory

from setuptools.command.build import build


class TemporaryBuild(build):  # type: ignore[misc]
    """Command `build` of setuptools with a new folder that is removed when Python ends."""

    def initialize_options(self) -> None:
        """Set the folder of all intermediate files."""
        super().initialize_options()
        self.build_base = _folder().name


@cache
def _folder() -> TemporaryDirectory[str]:
    """Return the folder of this process. Several commands of one build use it."""
    return TemporaryDirectory(prefix="pneuforce-build-")
