"""Generates the part of the client that follows from the description of the REST interface.

    python3 server/clients/python/generate.py            writes the files
    python3 server/clients/python/generate.py --check    names the files that differ from the description
"""

import json
import pathlib
import sys

from generator.operations import operation_modules
from generator.object_types import schema_module

HERE = pathlib.Path(__file__).resolve().parent
DESCRIPTION = HERE.parent.parent / "openapi.json"


def main() -> int:
    document = json.loads(DESCRIPTION.read_text(encoding="utf-8"))
    package = HERE / "gaitwright_client"
    made = {package / "schemas.py": schema_module(document)}
    for name, text in operation_modules(document).items():
        made[package / "operations" / name] = text
    present = {package / "schemas.py", *(package / "operations").glob("*.py")}
    wrong = sorted(path for path in made if not path.exists() or path.read_text(encoding="utf-8") != made[path])
    surplus = sorted(present - set(made))
    if "--check" in sys.argv[1:]:
        for path in wrong + surplus:
            print(f"{path.relative_to(HERE)} is not what generate.py makes from openapi.json")
        return 1 if wrong or surplus else 0
    (package / "operations").mkdir(exist_ok=True)
    for path in surplus:
        path.unlink()
    for path in wrong:
        path.write_text(made[path], encoding="utf-8", newline="\n")
    return 0


if __name__ == "__main__":
    sys.exit(main())
