"""Builds the wheel of the client. With no requirements of its own, it lets pip install the client without a network."""

import base64
import hashlib
import pathlib
import zipfile
from typing import Dict, NamedTuple, Optional

from gaitwright_client.operations import VERSION

HERE = pathlib.Path(__file__).resolve().parent
METADATA = """Metadata-Version: 2.4
Name: {name}
Version: {version}
Summary: {summary}
License-Expression: MIT OR Apache-2.0
Requires-Python: >=3.9
Provides-Extra: tables
Requires-Dist: numpy; extra == "tables"
Description-Content-Type: text/markdown
"""
WHEEL = """Wheel-Version: 1.0
Generator: gaitwright
Root-Is-Purelib: {pure}
Tag: {tag}
"""


def client_files() -> Dict[str, bytes]:
    """The modules of the client, by their path in a wheel."""
    package = HERE / "gaitwright_client"
    return {
        path.relative_to(HERE).as_posix(): path.read_bytes()
        for path in sorted(package.rglob("*"))
        if path.suffix == ".py" or path.name == "py.typed"
    }


class Wheel(NamedTuple):
    """The contents of a wheel. The same contents make the same file, bit by bit."""

    name: str
    summary: str
    tag: str
    modules: Dict[str, bytes]
    # Programs, which pip puts on the search path.
    scripts: Dict[str, bytes] = {}
    # Files for the folder of the environment, by their path in it.
    shared: Dict[str, bytes] = {}
    # Texts of licences, by file name.
    licences: Dict[str, bytes] = {}
    # In Markdown.
    description: bytes = b""

    def write(self, folder: pathlib.Path) -> str:
        """Writes the wheel and returns its file name."""
        stem = f"{self.name.replace('-', '_')}-{VERSION}"
        info = f"{stem}.dist-info"
        programs = {f"{stem}.data/scripts/{script}": content for script, content in self.scripts.items()}
        metadata = METADATA.format(name=self.name, version=VERSION, summary=self.summary)
        metadata += "".join(f"License-File: {name}\n" for name in self.licences)
        contents = {**self.modules, **programs}
        contents.update({f"{stem}.data/data/{path}": content for path, content in self.shared.items()})
        contents.update({f"{info}/licenses/{name}": content for name, content in self.licences.items()})
        contents[f"{info}/METADATA"] = metadata.encode() + b"\n" + self.description
        contents[f"{info}/WHEEL"] = WHEEL.format(pure="false" if programs else "true", tag=self.tag).encode()
        record = ""
        for path, content in contents.items():
            digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
            record += f"{path},sha256={digest},{len(content)}\n"
        contents[f"{info}/RECORD"] = f"{record}{info}/RECORD,,\n".encode()
        wheel = f"{stem}-{self.tag}.whl"
        with zipfile.ZipFile(folder / wheel, "w", zipfile.ZIP_DEFLATED) as archive:
            for path, content in contents.items():
                entry = zipfile.ZipInfo(path, (1980, 1, 1, 0, 0, 0))
                entry.create_system = 3  # Unix, so that the permissions below are read
                entry.external_attr = (0o100755 if path in programs else 0o100644) << 16
                archive.writestr(entry, content, zipfile.ZIP_DEFLATED)
        return wheel


def build_wheel(
    wheel_directory: str, config_settings: Optional[object] = None, metadata_directory: Optional[str] = None
) -> str:
    """The wheel of the client alone, called by pip."""
    summary = "A client of Gaitwright for lab scripts"
    return Wheel("gaitwright-client", summary, "py3-none-any", client_files()).write(pathlib.Path(wheel_directory))
