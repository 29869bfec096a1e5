"""Fast runner for the command `pneuforce`: each command runs in a fork of a prepared process."""

import multiprocessing
import os
import subprocess
import sys
from pathlib import Path
from tempfile import TemporaryDirectory

#: Server process that has imported the program. Each command runs in a fork of this process.
FORKSERVER = multiprocessing.get_context("forkserver")
FORKSERVER.set_forkserver_preload(
    [
        "__main__",
        "tests.command_runner",
        "pneuforce.instrument.cli.app",
        "pneuforce.instrument.config",
        "pneuforce.registers.views",
        "pneuforce.sim.factory",
    ]
)


def pneuforce(*words, cwd=None, timeout_s=600):
    """Run the command with these arguments and return its exit code, stdout and stderr."""
    with TemporaryDirectory() as folder:
        command = FORKSERVER.Process(target=_run, args=([*map(str, words)], folder, cwd or os.getcwd()))
        command.start()
        command.join(timeout_s)
        ended = not command.is_alive()
        command.kill()
        assert ended, f"the command did not end within {timeout_s} s: {words}"
        outputs = [(Path(folder) / name).read_text() for name in ("stdout", "stderr")]
    return subprocess.CompletedProcess(words, command.exitcode, *outputs)


def _run(words, folder, cwd):
    """Run the command in the forked process, with its output in files."""
    for descriptor, name in enumerate(("stdout", "stderr"), 1):
        os.dup2(os.open(f"{folder}/{name}", os.O_WRONLY | os.O_CREAT), descriptor)
    os.chdir(cwd)
    sys.argv = ["pneuforce", *words]
    from pneuforce.instrument.cli import main

    main()
