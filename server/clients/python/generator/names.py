"""Names in Python, made from names in the description."""

import re


def camel(name: str) -> str:
    return "".join(word[:1].upper() + word[1:] for word in re.split(r"[^A-Za-z0-9]+", name))


def snake(name: str) -> str:
    return re.sub(r"[^a-z0-9]+", "_", name.lower())


def singular(word: str) -> str:
    if word.endswith("ies"):
        return word[:-3] + "y"
    return word[:-1] if word.endswith("s") else word


def path_parameters(path: str) -> dict[str, str]:
    """The name of each parameter of a path: `id` in /studies/{id} is `study_id`."""
    parts = path.split("/")
    names = {}
    for before, part in zip(parts, parts[1:]):
        if part.startswith("{"):
            name = part[1:-1]
            names[name] = f"{snake(singular(before))}_id" if name == "id" else snake(name)
    return names
