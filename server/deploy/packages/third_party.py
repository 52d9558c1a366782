"""Licences of the crates in the program, with their texts."""

import json
import pathlib
import re
import subprocess
from typing import Any, Dict, List

from targets import Target

ROOT = pathlib.Path(__file__).resolve().parents[3]
TEXTS = re.compile(r"(licen[cs]e|copying|notice|unlicense|copyright)", re.IGNORECASE)


def cargo(*arguments: str) -> str:
    command = ["cargo", *arguments, "--locked", "--features", "gaitwright/full"]
    return subprocess.run(command, cwd=ROOT, check=True, capture_output=True, text=True).stdout


def crates(target: Target) -> List[Dict[str, Any]]:
    """The packages of other projects that the program of a target links, by name and version."""
    tree = ["tree", "--package", "gaitwright", "--edges", "normal", "--prefix", "none", "--format", "{p}"]
    linked = {tuple(line.split()[:2]) for line in cargo(*tree, "--target", target.triple).splitlines()}
    packages = json.loads(cargo("metadata", "--format-version", "1", "--filter-platform", target.triple))["packages"]
    others = [package for package in packages if package["source"] is not None]
    others = [package for package in others if (package["name"], f"v{package['version']}") in linked]
    return sorted(others, key=lambda package: (package["name"], package["version"]))


def notices(target: Target) -> bytes:
    """A list of the crates with their licences, then each text of a licence once."""
    listed: List[str] = []
    texts: Dict[str, List[str]] = {}
    for package in crates(target):
        name = f"{package['name']} {package['version']}"
        listed.append(f"{name}: {package['license'] or 'see below'}, {package['repository'] or 'no repository named'}")
        folder = pathlib.Path(package["manifest_path"]).parent
        for file in sorted(folder.iterdir()):
            if file.is_file() and TEXTS.match(file.name):
                text = file.read_text(encoding="utf-8", errors="replace").strip()
                texts.setdefault(text, []).append(name)
    parts = ["Crates in the program gaitwright, and their licences.", "\n".join(listed)]
    parts += [f"{'=' * 80}\n{', '.join(names)}\n\n{text}" for text, names in texts.items()]
    return ("\n\n".join(parts) + "\n").encode()
