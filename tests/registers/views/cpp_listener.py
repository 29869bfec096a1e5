"""C++ programs of the robot guide, compiled with strict warnings."""

import subprocess
from pathlib import Path

EXAMPLES = Path(__file__).parents[3] / "docs/examples"
STRICT = ["-std=c++17", "-O1", "-Wall", "-Wextra", "-Wpedantic", "-Wconversion", "-Wshadow", "-Werror"]


def compiled(folder, source=EXAMPLES / "robot_listener.cpp"):
    """Compile a program in `folder` and return the path of the program."""
    program = Path(folder) / source.stem
    subprocess.run(["g++", *STRICT, "-I", EXAMPLES, "-o", program, source], check=True)
    return program
