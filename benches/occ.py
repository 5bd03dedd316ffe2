"""What the comparisons with Open CASCADE share: the corpus, its Python, built examples."""

import os
import subprocess
import sys
import venv
from pathlib import Path

ROOT = Path(__file__).resolve().parent.parent
ENVIRONMENT = Path(os.environ.get("CLAYMILL_BENCH_VENV", ROOT / "target" / "bench-venv"))
OCP = "cadquery-ocp==7.9.3.1.1"


def corpus(arguments):
    """The folder of models: the first argument, else $CLAYMILL_CORPUS, else beside the repository."""
    folder = Path(arguments[0] if arguments else os.environ.get("CLAYMILL_CORPUS", ROOT / "../shared/corpus"))
    if not folder.is_dir():
        sys.exit(f"no corpus at {folder}")
    return folder


def python():
    """A Python with Open CASCADE, in a virtual environment that is made once."""
    interpreter = ENVIRONMENT / "bin" / "python"
    if not interpreter.exists():
        venv.create(ENVIRONMENT, with_pip=True)
        subprocess.run([interpreter, "-m", "pip", "install", "--quiet", OCP], check=True)
    return interpreter


def example(package, name):
    """A built example of a package, as fast as the command itself."""
    build = ["cargo", "build", "--profile", "dist", "--quiet", "-p", package, "--example", name]
    subprocess.run(build, cwd=ROOT, check=True)
    return ROOT / "target" / "dist" / "examples" / name
