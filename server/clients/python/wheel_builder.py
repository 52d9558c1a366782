"""Builds the wheel of the client. With no requirements of its own, it lets pip install the client without a network."""

import base64
import hashlib
import pathlib
import zipfile
from typing import Dict, Optional

from gaitwright_client.operations import VERSION

HERE = pathlib.Path(__file__).resolve().parent
METADATA = """Metadata-Version: 2.1
Name: {name}
Version: {version}
Summary: {summary}
License: MIT OR Apache-2.0
Requires-Python: >=3.9
Provides-Extra: tables
Requires-Dist: numpy; extra == "tables"
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


def write_wheel(
    folder: pathlib.Path, name: str, summary: str, tag: str, files: Dict[str, bytes], scripts: Dict[str, bytes]
) -> str:
    """Writes a wheel and returns its file name. `scripts` are programs, which pip puts on the search path.

    The same files make the same wheel, bit by bit.
    """
    stem = f"{name.replace('-', '_')}-{VERSION}"
    info = f"{stem}.dist-info"
    programs = {f"{stem}.data/scripts/{script}": content for script, content in scripts.items()}
    contents = {**files, **programs}
    contents[f"{info}/METADATA"] = METADATA.format(name=name, version=VERSION, summary=summary).encode()
    contents[f"{info}/WHEEL"] = WHEEL.format(pure="false" if scripts else "true", tag=tag).encode()
    record = ""
    for path, content in contents.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
        record += f"{path},sha256={digest},{len(content)}\n"
    contents[f"{info}/RECORD"] = f"{record}{info}/RECORD,,\n".encode()
    wheel = f"{stem}-{tag}.whl"
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
    return write_wheel(pathlib.Path(wheel_directory), "gaitwright-client", summary, "py3-none-any", client_files(), {})
