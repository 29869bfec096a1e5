"""Write the committed copies anew: `python -m registers.views`, from the top of the repository."""

from pathlib import Path

from registers.views import VIEWS

for view in VIEWS.values():
    Path(view.path).write_text(view.render(), encoding="utf-8")
    print(view.path)
