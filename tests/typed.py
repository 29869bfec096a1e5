"""`pneuforce` as it is typed, without the time that each new interpreter would take to load it."""

import multiprocessing
import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

#: One process loads the program once and forks for each command, which has descriptors and an end of its own.
LOADED = multiprocessing.get_context("forkserver")
LOADED.set_forkserver_preload(
    ["__main__", "tests.typed", "instrument.cli.app", "instrument.config", "registers.views", "sim.staging"]
)


def pneuforce(*words, cwd=None, timeout_s=120):
    """What came of the command: its exit code, stdout and stderr."""
    with TemporaryDirectory() as folder:
        command = LOADED.Process(target=_run, args=([*map(str, words)], folder, cwd or os.getcwd()))
        command.start()
        command.join(timeout_s)
        ended = not command.is_alive()
        command.kill()
        assert ended, f"not within {timeout_s} s: {words}"
        said = [(Path(folder) / name).read_text() for name in ("stdout", "stderr")]
    return subprocess.CompletedProcess(words, command.exitcode, *said)


def _run(words, folder, cwd):
    for descriptor, name in enumerate(("stdout", "stderr"), 1):
        os.dup2(os.open(f"{folder}/{name}", os.O_WRONLY | os.O_CREAT), descriptor)
    os.chdir(cwd)
    sys.argv = ["pneuforce", *words]
    from instrument.cli import main

    main()
