"""What a package contains besides the program and the client."""

import pathlib
from typing import Dict

PACKAGES = pathlib.Path(__file__).resolve().parent
ROOT = PACKAGES.parents[2]
LICENCES = {name: (ROOT / name).read_bytes() for name in ("LICENSE-APACHE", "LICENSE-MIT")}


def readme() -> Dict[str, bytes]:
    """How to begin with a package."""
    return {"README.md": (PACKAGES / "README.md").read_bytes()}


def unit() -> Dict[str, bytes]:
    """The systemd unit of a program in /usr/local/bin."""
    return {"gaitwright.service": (ROOT / "server/deploy/gaitwright.service").read_bytes()}


def examples() -> Dict[str, bytes]:
    """Scripts for laboratories, by file name."""
    clients = ROOT / "server" / "clients"
    files = [clients / "matlab/ask_tell.m", clients / "python/example.py", clients / "python/gait.ipynb"]
    return {file.name: file.read_bytes() for file in files}
