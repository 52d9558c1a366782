"""Python types of schemas."""

import json
import textwrap
from typing import Any, Callable

PLAIN = {"string": "str", "integer": "int", "number": "float", "boolean": "bool"}
Schema = dict[str, Any]


def reference(schema: Schema) -> str:
    return str(schema["$ref"]).rsplit("/", 1)[-1]


def literal(values: list[Any]) -> str:
    return f"Literal[{', '.join(json.dumps(value) for value in values)}]"


def alias(name: str, kind: str) -> list[str]:
    """The lines that give a type a name."""
    line = f"{name} = {kind}"
    if len(line) <= 120:
        return [line]
    head, values = kind[:-1].split("[", 1)
    inner = textwrap.wrap(values + ",", 112, break_on_hyphens=False, break_long_words=False)
    return [f"{name} = {head}[", *(f"    {part}" for part in inner), "]"]


def optional(name: str) -> str:
    return name if name == "Any" or name.startswith("Optional[") else f"Optional[{name}]"


def python_type(schema: Schema, inline: Callable[[Schema], str]) -> str:
    """The type of a schema. `inline` names the class of an object that is described in place."""
    if "$ref" in schema:
        return reference(schema)
    for way in ("oneOf", "anyOf"):
        if way in schema:
            choices = [choice for choice in schema[way] if choice.get("type") != "null"]
            names = [python_type(choice, inline) for choice in choices]
            name = names[0] if len(names) == 1 else f"Union[{', '.join(names)}]"
            return name if len(choices) == len(schema[way]) else optional(name)
    kind = schema.get("type")
    if isinstance(kind, list):
        (single,) = [one for one in kind if one != "null"]
        name = python_type({**schema, "type": single}, inline)
        return optional(name) if "null" in kind else name
    if "enum" in schema:
        return literal(schema["enum"])
    if kind == "array":
        return f"list[{python_type(schema['items'], inline)}]"
    if kind == "object" and "properties" in schema:
        return inline(schema)
    if kind == "object":
        values = schema.get("additionalProperties")
        return f"dict[str, {python_type(values, inline) if values else 'Any'}]"
    if kind is None:
        return "Any"
    if schema.get("format") == "binary":
        return "bytes"
    return PLAIN[kind]
