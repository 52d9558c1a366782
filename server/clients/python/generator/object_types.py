"""schemas.py of the client: a TypedDict for every object, an alias for every other schema."""

import json
import keyword
from typing import Optional

from .names import camel
from .text import comment, docstring, header, sentence
from .types import Schema, alias, python_type, reference

IMPORTS = """
from __future__ import annotations

from typing import Any, Literal, Optional, TypedDict, Union
"""


class Module:
    """Classes and aliases, each after those that it needs at run time."""

    def __init__(self, schemas: dict[str, Schema]) -> None:
        self.schemas = schemas
        self.blocks: dict[str, list[str]] = {}

    def add(self, name: str, schema: Schema) -> None:
        if name in self.blocks:
            return
        if "allOf" in schema:
            bases = [reference(part) for part in schema["allOf"] if "$ref" in part]
            for base in bases:
                self.add(base, self.schemas[base])
            properties: Schema = {}
            required: list[str] = []
            for part in schema["allOf"]:
                properties.update(part.get("properties", {}))
                required += part.get("required", [])
            self.add_object(name, {**schema, "properties": properties, "required": required}, bases)
        elif "properties" in schema or schema.get("additionalProperties") is False:
            self.add_object(name, schema, ["TypedDict"])
        else:
            if "$ref" in schema:
                self.add(reference(schema), self.schemas[reference(schema)])
            lines = comment(schema["description"], "") if "description" in schema else []
            self.blocks[name] = [*lines, *alias(name, self.type_of(name, schema))]

    def type_of(self, name: str, schema: Schema) -> str:
        def inline(part: Schema) -> str:
            kind = part["properties"].get("kind", {}).get("enum", [""])
            own = name + camel(kind[0])
            self.add(own, part)
            return own

        return python_type(schema, inline)

    def add_object(self, name: str, schema: Schema, bases: list[str]) -> None:
        properties = schema.get("properties", {})
        required = {key: value for key, value in properties.items() if key in schema.get("required", [])}
        others = {key: value for key, value in properties.items() if key not in required}
        lines: list[str] = []
        if required and others:
            lines += [*self.fields(f"_{name}Required", name, required, bases, True, None), "", ""]
            bases = [f"_{name}Required"]
        total = not others
        lines += self.fields(name, name, others or required, bases, total, schema.get("description"))
        self.blocks[name] = lines

    def fields(
        self, own: str, name: str, properties: dict[str, Schema], bases: list[str], total: bool, about: Optional[str]
    ) -> list[str]:
        typed = {key: self.type_of(name + camel(key), value) for key, value in properties.items()}
        if any(keyword.iskeyword(key) for key in typed):
            return self.call(own, properties, typed, bases, total)
        lines = [f"class {own}({', '.join(bases)}{'' if total else ', total=False'}):"]
        if about:
            lines += [*docstring(sentence(about), "    "), ""]
        for key, kind in typed.items():
            lines += [*self.about(properties[key]), f"    {key}: {kind}"]
        return lines if typed or about else [*lines, "    pass"]

    def call(
        self, own: str, properties: dict[str, Schema], typed: dict[str, str], bases: list[str], total: bool
    ) -> list[str]:
        """A class with a field that is a keyword of Python, such as `from`."""
        if bases != ["TypedDict"]:
            raise NotImplementedError(f"{own} has bases and a field that is a keyword")
        lines = [f"{own} = TypedDict(", f'    "{own}",', "    {"]
        for key, kind in typed.items():
            lines += [f"    {line}" for line in self.about(properties[key])]
            lines.append(f"        {json.dumps(key)}: {json.dumps(kind)},")
        return [*lines, "    },", *([] if total else ["    total=False,"]), ")"]

    @staticmethod
    def about(schema: Schema) -> list[str]:
        """The description of a field, or that of the schema in it."""
        choices = [schema, *schema.get("oneOf", [])]
        text = next((choice["description"] for choice in choices if "description" in choice), "")
        return comment(text, "    ")


def schema_module(document: Schema) -> str:
    schemas = document["components"]["schemas"]
    module = Module(schemas)
    for name in sorted(schemas):
        # A page is read by `Pages`.
        if set(schemas[name].get("properties", {})) != {"items", "next"}:
            module.add(name, schemas[name])
    blocks = module.blocks.values()
    unions = [lines for lines in blocks if any(" = Union[" in line for line in lines)]
    classes = [lines for lines in blocks if lines[-1] == ")" or any(line.startswith("class ") for line in lines)]
    text = header("The objects of the REST interface, as typed dictionaries.") + IMPORTS
    for lines in blocks:
        if lines not in unions and lines not in classes:
            text += "\n" + "\n".join(lines) + "\n"
    # A union is evaluated when the module is imported, so it follows its classes.
    for lines in classes:
        text += "\n\n" + "\n".join(lines) + "\n"
    for lines in unions:
        text += "\n\n" + "\n".join(lines) + "\n"
    return text
