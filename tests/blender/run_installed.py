"""Install a zip in the bpy wheel that runs this, and run tests there.

python run_installed.py ZIP WORD ...
"""

import runpy
import sys
from pathlib import Path

import bpy


def main() -> None:
    """Install the zip into the user folder of this bpy, and run run_all.py with the words."""
    archive, *words = sys.argv[1:]
    bpy.ops.extensions.package_install_files(
        filepath=archive, repo="user_default", enable_on_install=True
    )
    script = Path(__file__).with_name("run_all.py")
    sys.argv = [str(script), *words]
    runpy.run_path(str(script), run_name="__main__")


if __name__ == "__main__":
    main()
