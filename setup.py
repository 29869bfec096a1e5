"""Build step that rejects a wheel without uPlot, because its web page would have no plots.

Everything else is in pyproject.toml.
"""

from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py
from setuptools.errors import SetupError

VENDORED = Path(__file__).with_name("web") / "static/vendor"


class BuildWithPlots(build_py):
    """Build step that requires uPlot, except for an editable installation."""

    def run(self) -> None:
        """Build. Raises SetupError if uPlot has not been fetched."""
        if not self.editable_mode and not (VENDORED / "uPlot.esm.js").is_file():
            raise SetupError(f"{VENDORED} contains no uPlot for the web page: run make vendor, or make wheel")
        super().run()


setup(cmdclass={"build_py": BuildWithPlots})
