"""The README, the pages of the handbook, and the code in them."""

from __future__ import annotations

import re
from collections.abc import Iterator
from pathlib import Path
from typing import NamedTuple

from robocov_app.commands.handbook import find_page_sources

ROOT = Path(__file__).parents[2]
README = ROOT / "README.md"
INDEX_DESCRIPTION = ROOT / ".readme/package.md"
"""Description of the project on package indexes."""

_CODE_BLOCK = re.compile(r"```(\w+)\n(.*?)```", re.DOTALL)


class CodeBlock(NamedTuple):
    """A block of code in a page."""

    language: str
    """Such as ``python`` or ``sh``."""
    code: str
    preceding_text: str
    """The text of the page before the block."""


def list_handbook_pages() -> list[Path]:
    """Return the files of the handbook's pages, in alphabetical order."""
    return sorted(find_page_sources().glob("*.md"))


def read_handbook_page(name: str) -> str:
    """Return the text of a page by the name of its file without the suffix."""
    return (find_page_sources() / f"{name}.md").read_text(encoding="utf-8")


def find_code_blocks(text: str) -> Iterator[CodeBlock]:
    """Yield the blocks of code in a page, from top to bottom."""
    for match in _CODE_BLOCK.finditer(text):
        language, code = match.groups()
        yield CodeBlock(language, code, text[: match.start()])


def find_code(text: str, language: str, part: str) -> str:
    """Return the first block of code in a language that contains a part."""
    return next(
        block.code for block in find_code_blocks(text) if block.language == language and part in block.code
    )


def find_file_name(block: CodeBlock) -> str | None:
    """Return the name of the file that a block shows; None if it shows none.

    The first line may be a comment with the name. A JSON or TOML file has the name that the text mentioned
    last.
    """
    comment = re.match(r"# ([\w.-]+)\n", block.code)
    if comment is not None:
        return comment[1]
    if block.language not in ("json", "toml"):
        return None
    mentioned_names = re.findall(r"`([\w-]+\.(?:json|toml|robocov))`", block.preceding_text)
    return mentioned_names[-1] if mentioned_names else "map.json"


def list_commands(code: str) -> Iterator[str]:
    """Yield the `robocov` commands in a block of shell code, each on one line and without comments."""
    for line in code.replace("\\\n", " ").splitlines():
        if line.startswith("robocov "):
            command, _, _ = line.partition(" # ")
            yield command.strip()
