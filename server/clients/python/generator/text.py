"""Comments and docstrings of at most 120 columns."""

import textwrap

HEADER = '''"""{subject}

Made by generate.py from server/openapi.json.
"""
'''


def header(subject: str) -> str:
    return HEADER.format(subject=subject)


def wrapped(text: str, columns: int) -> list[str]:
    paragraphs = text.split("\n\n")
    lines: list[str] = []
    for paragraph in paragraphs:
        if lines:
            lines.append("")
        lines += textwrap.wrap(" ".join(paragraph.split()), columns, break_long_words=False)
    return lines


def comment(text: str, indent: str) -> list[str]:
    return [f"{indent}# {line}".rstrip() for line in wrapped(text, 118 - len(indent))]


def sentence(text: str) -> str:
    text = text.strip()
    return text if text.endswith((".", ":", "?")) else text + "."


def docstring(text: str, indent: str) -> list[str]:
    lines = wrapped(text.replace("\\", "\\\\"), 112)
    if len(lines) == 1:
        return [f'{indent}"""{lines[0]}"""']
    return [f'{indent}"""{lines[0]}', *(f"{indent}{line}".rstrip() for line in lines[1:]), f'{indent}"""']
