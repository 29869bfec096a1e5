"""Test of the completion of words in bash: the shell really offers commands and options."""

import os
import subprocess
import sys
from pathlib import Path

import pytest

COMPLETE = """
eval "$(_PNEUFORCE_COMPLETE=source_bash pneuforce)"
complete -p pneuforce
COMP_WORDS=(pneuforce {words}) COMP_CWORD={count}
_pneuforce_completion pneuforce
printf '%s\\n' "${{COMPREPLY[@]}}"
"""


@pytest.mark.parametrize(
    ("words", "offered"),
    [
        ("calib", ["calibrate"]),
        ("sim pr", ["press"]),
        ("calibrate gr", ["grip"]),
        ("sim fault bur", ["burst", "bursts"]),
        ("hold --take", ["--take-over"]),
        ("log verify --wit", ["--witness"]),
    ],
)
def test_bash_offers_the_commands_and_the_options(words, offered):
    path = f"{Path(sys.executable).parent}:{os.environ['PATH']}"
    script = COMPLETE.format(words=words, count=len(words.split()))
    done = subprocess.run(
        ["bash", "--norc", "-c", script],
        env={**os.environ, "PATH": path},
        capture_output=True,
        text=True,
        timeout=600,
        check=False,
    )
    registered, *lines = done.stdout.splitlines()
    assert (registered.endswith("pneuforce"), lines) == (True, offered), done.stderr
