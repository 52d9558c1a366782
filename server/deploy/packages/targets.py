"""What the target of a build means for its packages."""

import re
import subprocess
from typing import NamedTuple, Tuple

DEBIAN = {"x86_64": "amd64", "aarch64": "arm64"}
WINDOWS = {"x86_64": "win_amd64", "aarch64": "win_arm64"}
# Oldest macOS that Rust supports.
MACOS = {"x86_64": "macosx_10_12_x86_64", "aarch64": "macosx_11_0_arm64"}


class Target(NamedTuple):
    """A target of the Rust compiler."""

    triple: str

    @property
    def machine(self) -> str:
        return self.triple.split("-")[0]

    @property
    def is_windows(self) -> bool:
        return "windows" in self.triple

    @property
    def is_glibc(self) -> bool:
        return self.triple.endswith("linux-gnu")

    def wheel_tag(self, program: bytes) -> str:
        """Tag of a wheel with this program."""
        if self.is_glibc:
            major, minor = glibc_of(program)
            return f"py3-none-manylinux_{major}_{minor}_{self.machine}"
        if self.is_windows:
            return f"py3-none-{WINDOWS[self.machine]}"
        if "apple" in self.triple:
            return f"py3-none-{MACOS[self.machine]}"
        raise SystemExit(f"There is no wheel tag for {self.triple}. Targets: Linux with glibc, macOS, Windows.")


def host() -> Target:
    """The target of this machine."""
    about = subprocess.run(["rustc", "-vV"], check=True, capture_output=True, text=True).stdout
    found = re.search(r"^host: (\S+)$", about, re.MULTILINE)
    if found is None:
        raise SystemExit("The output of rustc -vV does not name the host.")
    return Target(found.group(1))


def glibc_of(program: bytes) -> Tuple[int, int]:
    """The newest version of glibc whose symbols a program uses."""
    versions = [(int(major), int(minor)) for major, minor in re.findall(rb"\0GLIBC_(\d+)\.(\d+)", program)]
    if not versions:
        raise SystemExit("The program does not state the glibc version that it needs.")
    return max(versions)
