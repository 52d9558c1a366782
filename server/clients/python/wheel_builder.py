"""Builds the wheel of the client. With no requirements of its own, it lets pip install the client without a network."""

import base64
import hashlib
import pathlib
import zipfile
from typing import Optional

from gaitwright_client.operations import VERSION

HERE = pathlib.Path(__file__).resolve().parent
INFO = f"gaitwright_client-{VERSION}.dist-info"
METADATA = f"""Metadata-Version: 2.1
Name: gaitwright-client
Version: {VERSION}
Summary: A client of Gaitwright for lab scripts
License: MIT OR Apache-2.0
Requires-Python: >=3.9
Provides-Extra: tables
Requires-Dist: numpy; extra == "tables"
"""
WHEEL = """Wheel-Version: 1.0
Generator: gaitwright
Root-Is-Purelib: true
Tag: py3-none-any
"""


def build_wheel(
    wheel_directory: str, config_settings: Optional[object] = None, metadata_directory: Optional[str] = None
) -> str:
    package = HERE / "gaitwright_client"
    files = {
        path.relative_to(HERE).as_posix(): path.read_bytes()
        for path in sorted(package.rglob("*"))
        if path.suffix == ".py" or path.name == "py.typed"
    }
    files[f"{INFO}/METADATA"] = METADATA.encode()
    files[f"{INFO}/WHEEL"] = WHEEL.encode()
    record = ""
    for name, content in files.items():
        digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
        record += f"{name},sha256={digest},{len(content)}\n"
    files[f"{INFO}/RECORD"] = f"{record}{INFO}/RECORD,,\n".encode()
    wheel = f"gaitwright_client-{VERSION}-py3-none-any.whl"
    with zipfile.ZipFile(pathlib.Path(wheel_directory) / wheel, "w", zipfile.ZIP_DEFLATED) as archive:
        for name, content in files.items():
            # The same date for every file makes the same wheel from the same files.
            archive.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), content, zipfile.ZIP_DEFLATED)
    return wheel
