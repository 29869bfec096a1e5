"""Regenerate the committed documents: run `python -m pneuforce.registers.views` in the repository root."""

from pathlib import Path

from pneuforce.registers.views import VIEWS

for view in VIEWS.values():
    Path(view.path).write_text(view.render(), encoding="utf-8")
    print(view.path)
