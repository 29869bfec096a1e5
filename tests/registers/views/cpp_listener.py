"""C++ listener of the robot guide, compiled with strict warnings."""

import subprocess
from pathlib import Path

EXAMPLES = Path(__file__).parents[3] / "docs/examples"
STRICT = ["-std=c++17", "-O1", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]


def compiled(folder):
    """Compile the listener in `folder` and return the path of the program."""
    program = Path(folder) / "robot_listener"
    subprocess.run(["g++", *STRICT, "-o", program, EXAMPLES / "robot_listener.cpp"], check=True)
    return program
