"""A wheel without uPlot would have a page without plots: it is not built. All else is in pyproject.toml."""

from pathlib import Path

from setuptools import setup
from setuptools.command.build_py import build_py
from setuptools.errors import SetupError

VENDORED = Path(__file__).with_name("page") / "static/vendor"


class BuildWithPlots(build_py):
    """Refuses where uPlot has not been fetched; an editable install may do without."""

    def run(self) -> None:
        """Build. Raises SetupError."""
        if not self.editable_mode and not (VENDORED / "uPlot.esm.js").is_file():
            raise SetupError(f"{VENDORED} lacks uPlot, which draws the page: run make vendor, or make wheel")
        super().run()


setup(cmdclass={"build_py": BuildWithPlots})
