"""Program that regenerates the committed documents.

Run `python -m pneuforce.registers.views` in the root directory of the repository.
"""

from pathlib import Path

from pneuforce.registers.views import VIEWS

for view in VIEWS.values():
    Path(view.path).write_text(view.render(), encoding="utf-8")
    print(view.path)
