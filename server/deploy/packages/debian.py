"""The Debian package: the program, its systemd unit and an empty file of settings."""

import hashlib
from typing import Dict, Tuple

from archives import File, ar, tar_gz
from contents import examples, readme, unit

DEBIAN_NAME = "gaitwright_{version}_{architecture}.deb"
CONTROL = """Package: gaitwright
Version: {version}
Architecture: {architecture}
Maintainer: Gaitwright <gaitwright@localhost>
Installed-Size: {kibibytes}
Depends: libc6 (>= {glibc}), libgcc-s1
Section: science
Priority: optional
Description: tuning of walking gaits for powered prostheses
 Gaitwright tunes walking gaits of powered prostheses: a preference learner
 proposes bounds, an optimiser computes gaits within them, and people or Gait
 RMSE compare the gaits.
"""
# The administrator starts the service after editing the settings. An upgrade, whose second argument is the old version,
# restarts a running service.
POSTINST = """#!/bin/sh
set -e
if [ -d /run/systemd/system ]; then
    systemctl daemon-reload
    if [ -n "$2" ]; then systemctl try-restart gaitwright || true; fi
fi
"""
PRERM = """#!/bin/sh
set -e
if [ "$1" = remove ] && [ -d /run/systemd/system ]; then systemctl disable --now gaitwright || true; fi
"""
SETTINGS = "# Settings of `gaitwright serve`; `gaitwright config show` lists them. The unit sets the folder of the record.\n"


def deb(program: bytes, licences: Dict[str, bytes], version: str, architecture: str, glibc: Tuple[int, int]) -> bytes:
    """The package of a program that needs this version of glibc."""
    documents = {
        "copyright": b"\n".join(licences.values()),
        **readme(),
        **{f"examples/{example}": content for example, content in examples().items()},
    }
    files = [
        File("./etc/gaitwright.toml", SETTINGS.encode()),
        File("./usr/bin/gaitwright", program, 0o755),
        *(
            File(f"./usr/lib/systemd/system/{name}", content.replace(b"/usr/local/bin/", b"/usr/bin/"))
            for name, content in unit().items()
        ),
        *(File(f"./usr/share/doc/gaitwright/{name}", content) for name, content in documents.items()),
    ]
    sums = "".join(f"{hashlib.md5(file.content).hexdigest()}  {file.path[2:]}\n" for file in files)
    control = CONTROL.format(
        version=version,
        architecture=architecture,
        kibibytes=sum(len(file.content) for file in files) // 1024 + 1,
        glibc=".".join(map(str, glibc)),
    )
    about = [
        File("./conffiles", b"/etc/gaitwright.toml\n"),
        File("./control", control.encode()),
        File("./md5sums", sums.encode()),
        File("./postinst", POSTINST.encode(), 0o755),
        File("./prerm", PRERM.encode(), 0o755),
    ]
    members = [("control.tar.gz", tar_gz(about)), ("data.tar.gz", tar_gz(files, with_folders=True))]
    return ar([("debian-binary", b"2.0\n"), *members])
