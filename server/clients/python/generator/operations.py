"""operations/ of the client: a class for every tag, with a method for every operation."""

import re
from typing import Any, Optional

from .names import camel, path_parameters, snake
from .text import docstring, header, sentence
from .types import Schema, alias, literal, optional, python_type, reference

VERBS = ("get", "post", "put", "patch", "delete")
# Parameters that the client sets itself.
PAGING = ("cursor", "limit")
# Parameters for browsers.
BROWSER = ("download",)
KEY = "Idempotency-Key"
REVISION = "If-Match"
RESUME = "Last-Event-ID"


def no_inline(schema: Schema) -> str:
    raise NotImplementedError(f"an object described in place: {schema}")


class Operation:
    """One operation of the description, as a method."""

    def __init__(self, document: Schema, path: str, verb: str, operation: Schema) -> None:
        self.schemas = document["components"]["schemas"]
        self.path, self.verb, self.operation = path, verb.upper(), operation
        self.name: str = operation["operationId"]
        self.names = path_parameters(path)
        self.used: set[str] = set()
        self.aliases: dict[str, str] = {}
        parameters = operation.get("parameters", [])
        self.by_place = {
            place: {one["name"]: one for one in parameters if one["in"] == place and one["name"] not in BROWSER}
            for place in ("path", "query", "header")
        }
        unknown = set(self.by_place["header"]) - {KEY, REVISION, RESUME}
        if unknown:
            raise NotImplementedError(f"{self.name} has headers that the client does not set: {unknown}")

    def type_of(self, schema: Schema) -> str:
        name = python_type(schema, no_inline)
        self.used.update(word for word in re.findall(r"\w+", name) if word in self.schemas)
        return name

    def success(self) -> tuple[str, Schema]:
        """The content type and the schema of the response."""
        found: dict[str, Schema] = {}
        for status, response in self.operation["responses"].items():
            if status.startswith("2"):
                found.update({kind: content["schema"] for kind, content in response["content"].items()})
        # A figure is bytes in one of its formats, and text in the others.
        binary = [kind for kind in found if kind != "application/json" and not kind.startswith("text/")]
        kind = binary[0] if binary else next(iter(found))
        return kind, found[kind]

    def entry(self, schema: Schema) -> Optional[Schema]:
        """The schema of an entry, if the response is a page of a list."""
        page = self.schemas.get(reference(schema), {}) if "$ref" in schema else {}
        entries = page.get("properties", {}).get("items")
        return entries["items"] if entries and set(page["properties"]) == {"items", "next"} else None

    def body(self) -> Optional[str]:
        content = self.operation.get("requestBody", {}).get("content", {})
        if not content:
            return None
        schema = content["application/json"]["schema"]
        return self.type_of(schema)

    def is_list(self) -> bool:
        return "cursor" in self.by_place["query"]

    def parameters(self) -> list[str]:
        at = [f"{self.names[name]}: {self.type_of(one['schema'])}" for name, one in self.by_place["path"].items()]
        named = []
        for name, one in self.by_place["query"].items():
            if name in PAGING:
                continue
            values = one["schema"].get("enum")
            kind = self.enumeration(name, values) if values else self.type_of(one["schema"])
            named.append(f"{name}: {kind}" if one.get("required") else f"{name}: {optional(kind)} = None")
        if self.is_list():
            named.append("page_size: Optional[int] = None")
        if REVISION in self.by_place["header"]:
            named.append("revision: Optional[int] = None")
        if KEY in self.by_place["header"]:
            named.append("idempotency_key: Optional[str] = None")
        body = self.body()
        more = [f"**body: Unpack[{body}]"] if body else []
        return ["self", *at, *(["*"] if named else []), *named, *more]

    def enumeration(self, parameter: str, values: list[str]) -> str:
        """The type of an enumeration, under a name of its own if it is long."""
        if len(values) <= 8:
            return literal(values)
        name = camel(f"{self.name}_{parameter}")
        self.aliases[name] = literal(values)
        return name

    def arguments(self) -> list[str]:
        """What the method passes on, after the path."""
        at = ", ".join(f'"{name}": {self.names[name]}' for name in self.by_place["path"])
        passed = [f"{{{at}}}"] if at else []
        query = [f'"{name}": {name}' for name in self.by_place["query"] if name not in PAGING]
        if self.is_list():
            query.append('"limit": page_size')
        if query:
            passed.append(f"query={{{', '.join(query)}}}")
        if REVISION in self.by_place["header"]:
            passed.append("revision=revision")
        if self.body():
            passed.append("body=body")
        if self.verb != "GET":
            passed.append("key=idempotency_key" if KEY in self.by_place["header"] else "repeatable=False")
        return passed

    def call(self) -> tuple[str, Optional[str], str, list[str]]:
        """The type that the method returns, the type to cast to, and the function that it calls with its arguments."""
        kind, schema = self.success()
        rest = [f'"{self.path}"', *self.arguments()]
        if self.is_list():
            entry = self.entry(schema)
            if entry is None:
                raise NotImplementedError(f"{self.name} is paged and does not return a page")
            return f"Pages[{self.type_of(entry)}]", None, "Pages", ["self", *rest]
        if kind == "text/event-stream":
            return "Iterator[Event]", None, "follow", ["self", *rest]
        rest = [f'"{self.verb}"', *rest]
        if kind == "application/json":
            result = self.type_of(schema)
            return result, result if result.isidentifier() else f'"{result}"', "self.request_json", rest
        if kind.startswith("text/"):
            return "str", None, "self.request_text", rest
        return "bytes", None, "self.request_bytes", rest

    def about(self) -> str:
        parts = [sentence(self.operation["summary"])]
        if "description" in self.operation:
            parts.append(self.operation["description"])
        queries = self.by_place["query"].items()
        parts += [f"{name}: {sentence(one['description'])}" for name, one in queries if name not in PAGING]
        body = self.body()
        if body:
            schema = self.schemas[body]
            required = [name for name in schema["properties"] if name in schema.get("required", [])]
            others = [name for name in schema["properties"] if name not in required]
            fields = [", ".join(required), f"optionally {', '.join(others)}" if others else ""]
            parts.append(f"Fields: {'; '.join(part for part in fields if part)}.")
        return "\n\n".join(parts)

    def method(self) -> list[str]:
        result, cast, function, arguments = self.call()
        parameters = self.parameters()
        lines = [f"    def {self.name}({', '.join(parameters)}) -> {result}:"]
        if len(lines[0]) > 120:
            inner = ",\n        ".join(parameters)
            lines = [f"    def {self.name}(", f"        {inner},", f"    ) -> {result}:"]
        lines += docstring(self.about(), "        ")
        call = f"{function}({', '.join(arguments)})"
        line = f"        return cast({cast}, {call})" if cast else f"        return {call}"
        if len(line) <= 120:
            return [*lines, line]
        indent = " " * (16 if cast else 12)
        call = f"{function}(\n{indent}" + f",\n{indent}".join(arguments) + f",\n{indent[4:]})"
        if cast:
            call = f"cast(\n            {cast},\n            {call},\n        )"
        return [*lines, f"        return {call}"]


def imports(operations: list[Operation], words: list[str]) -> list[str]:
    """The imports of a module with these words."""
    unpack = "Unpack" in words
    typing = [name for name in ("Literal", "Optional", "Union", "cast") if name in words]
    lines = ["from collections.abc import Iterator"] if "Iterator" in words else []
    lines += [f"from typing import {', '.join(typing)}", ""] if typing else [""] if lines else []
    if "Event" in words:
        lines.append("from ..events import Event, follow")
    if "Pages" in words:
        lines.append("from ..paging import Pages")
    used = sorted(set().union(*(operation.used for operation in operations)))
    lines += ["from ..schemas import (", *(f"    {name}," for name in used), ")"] if used else []
    lines.append("from ..transport import Transport")
    lines += ["from ..unpack import Unpack"] if unpack else []
    return lines


def module(tag: str, operations: list[Operation]) -> str:
    methods = "\n".join("\n".join(operation.method()) + "\n" for operation in operations)
    named = [one for operation in operations for one in operation.aliases.items()]
    aliases = [line for name, kind in named for line in alias(name, kind)]
    about = f"Operations with the tag `{tag}`."
    words = re.split(r"\W+", methods + " ".join(aliases))
    lines = [header(about), "from __future__ import annotations", "", *imports(operations, words)]
    lines += ["", *aliases] if aliases else []
    lines += ["", "", f"class {camel(tag)}Methods(Transport):", f'    """{about}"""', ""]
    return "\n".join(lines) + "\n" + methods


def operation_modules(document: Schema) -> dict[str, str]:
    """The text of every file of operations/, by its name."""
    by_tag: dict[str, list[Operation]] = {}
    for path, item in document["paths"].items():
        for verb in VERBS:
            if verb in item:
                (tag,) = item[verb]["tags"]
                by_tag.setdefault(tag, []).append(Operation(document, path, verb, item[verb]))
    tags = sorted(by_tag)
    made: dict[str, Any] = {f"{snake(tag)}.py": module(tag, by_tag[tag]) for tag in tags}
    lines = [f"from .{snake(tag)} import {camel(tag)}Methods" for tag in tags]
    bases = [f"    {camel(tag)}Methods," for tag in tags]
    made["__init__.py"] = "\n".join(
        [
            header("Every operation of the REST interface, in a file for each tag."),
            *lines,
            "",
            f'VERSION = "{document["info"]["version"]}"',
            "",
            "",
            "class Operations(",
            *bases,
            "):",
            '    """Every operation as a method, named by its `operationId`."""',
            "",
        ]
    )
    return made
