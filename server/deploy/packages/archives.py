"""Archives that depend only on their content: fixed times and owners, in the order given."""

import gzip
import io
import tarfile
from typing import List, NamedTuple, Tuple


class File(NamedTuple):
    """A file of a package."""

    path: str
    content: bytes
    mode: int = 0o644


def tar_gz(files: List[File], with_folders: bool = False) -> bytes:
    """A compressed tar archive; `with_folders` adds an entry for each folder."""
    plain = io.BytesIO()
    known = set()
    with tarfile.open(fileobj=plain, mode="w", format=tarfile.GNU_FORMAT) as archive:
        for file in files:
            parts = file.path.split("/")
            for depth in range(1, len(parts)):
                folder = "/".join(parts[:depth])
                if with_folders and folder not in known:
                    known.add(folder)
                    entry = tarfile.TarInfo(folder)
                    entry.type, entry.mode = tarfile.DIRTYPE, 0o755
                    archive.addfile(entry)
            entry = tarfile.TarInfo(file.path)
            entry.size, entry.mode = len(file.content), file.mode
            archive.addfile(entry, io.BytesIO(file.content))
    packed = io.BytesIO()
    with gzip.GzipFile(filename="", fileobj=packed, mode="wb", compresslevel=9, mtime=0) as out:
        out.write(plain.getvalue())
    return packed.getvalue()


def ar(members: List[Tuple[str, bytes]]) -> bytes:
    """A Unix archive, the outer form of a Debian package."""
    packed = b"!<arch>\n"
    for name, content in members:
        packed += f"{name:<16}{0:<12}{0:<6}{0:<6}{'100644':<8}{len(content):<10}`\n".encode() + content
        packed += b"\n" if len(content) % 2 else b""
    return packed
