"""What the README and the pages of docs/ say to type."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path

ROOT = Path(__file__).parents[2]
PAGES = [
    ROOT / "README.md",
    ROOT / "CONTRIBUTING.md",
    ROOT / "SECURITY.md",
    *sorted((ROOT / "docs").rglob("*.md")),
]
BLOCK = re.compile(r"^(?:<!-- not run: (.+?) -->\n+)?```(\w+)\n(.*?)^```", re.M | re.S)


@dataclass(frozen=True)
class Block:
    """Code of a page; `not_run` says why it only has to be understood, or is empty."""

    page: str
    kind: str
    text: str
    not_run: str

    @property
    def lines(self) -> list[str]:
        """Commands without their comments."""
        typed = (re.split(r"\s+# ", line)[0].strip() for line in self.text.split("\n"))
        return [line for line in typed if line]


def blocks_of(page: Path) -> list[Block]:
    text, name = page.read_text(encoding="utf-8"), page.relative_to(ROOT).as_posix()
    return [Block(name, kind, code, why or "") for why, kind, code in BLOCK.findall(text)]


BLOCKS = [block for page in PAGES for block in blocks_of(page)]
SHELL = [block for block in BLOCKS if block.kind == "sh"]
PYTHON = {
    page: [b.text for b in BLOCKS if b.page == page and b.kind == "python"]
    for page in dict.fromkeys(b.page for b in BLOCKS if b.kind == "python")
}
LOOKS = ("python -c ", "ls ")
LINES = [line for block in SHELL for line in block.lines]
RUN = {
    line: b.page
    for b in reversed(SHELL)
    if not b.not_run
    for line in reversed(b.lines)
    if line.startswith("elocute ")
}
"""Commands, and the first page that says to type each."""
FIRST_PAGES = ("README.md", "docs/get-started.md", "docs/use/animate.md")
"""What everybody reads is run in `make test`; the other pages are marked slow."""
UNDERSTOOD = dict.fromkeys(
    line for b in SHELL if b.not_run for line in b.lines if line.startswith("elocute ")
)
NAMED = {
    " ".join(found.split())
    for page in PAGES
    for found in re.findall(
        r"`elocute ([a-z][a-z ]*[a-z])(?: [^`]*)?`",
        re.sub(r"```.*?```", "", page.read_text(encoding="utf-8"), flags=re.S),
    )
}
