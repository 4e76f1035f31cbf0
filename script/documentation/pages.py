# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""The pages of the documentation, taken apart: headings, links, code blocks."""
import pathlib
import re

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
FENCE = re.compile(r"^( *)(```+)\s*([\w+-]*)\s*$")
HEADING = re.compile(r"^#{1,6} +(.*?) *#*$")
# One marker before a block: <!-- not run: REASON -->, <!-- synopsis -->, <!-- from FILE -->,
# <!-- file: NAME -->, <!-- run: ARGUMENTS -->, <!-- status: N -->.
MARKER = re.compile(r"^ *<!-- (not run|synopsis|from|file|run|status)(?:: ?| )?(.*?) ?-->$")
LINK = re.compile(r"!?\[(?:[^\[\]]|\[[^\]]*\])*\]\(([^()\s]+)(?: \"[^\"]*\")?\)")
SOURCE = re.compile(r"<(?:img|source|a)\s[^>]*?(?:src|srcset|href)=\"([^\"]+)\"")


class Block:
    """A fenced block: where it begins, its language, its text, and what the comment above it says."""

    def __init__(self, page, line, language, marker):
        self.page, self.line, self.language = page, line, language
        self.kind, self.value = marker
        self.lines = []

    @property
    def text(self):
        return "".join(line + "\n" for line in self.lines)

    @property
    def where(self):
        return f"{self.page.relative_to(ROOT)}:{self.line}"


class Page:
    def __init__(self, path):
        self.path = path
        self.blocks, self.headings, self.links = [], [], []  # Links are (line, target).
        self.faults = []
        self._read(path.read_text(encoding="utf-8").split("\n"))

    def _read(self, lines):
        block, indent, closing = None, 0, ""
        for number, line in enumerate(lines, 1):
            fence = FENCE.match(line)
            if block is None and fence:
                indent, closing = len(fence[1]), fence[2]
                block = Block(self.path, number, fence[3], marker_above(lines, number - 1))
            elif block is not None and line.strip() == closing:
                self.blocks.append(block)
                block = None
            elif block is not None:
                block.lines.append(line[indent:])
            else:
                self._read_text(number, line)
        if block is not None:
            self.faults.append(f"{block.where}: the code block is never closed")

    def _read_text(self, number, line):
        heading = HEADING.match(line)
        if heading:
            self.headings.append(heading[1])
        line = re.sub(r"`[^`]*`", "``", line)
        for target in LINK.findall(line) + SOURCE.findall(line):
            self.links.append((number, target))

    def anchors(self):
        found, names = {}, set()
        for heading in self.headings:
            name = anchor_of(heading)
            count = found.get(name, 0)
            found[name] = count + 1
            names.add(f"{name}-{count}" if count else name)
        return names


def marker_above(lines, index):
    """The marker in the line above, or above an empty line."""
    for above in (index - 1, index - 2):
        if above < 0:
            break
        found = MARKER.match(lines[above])
        if found:
            return found[1], found[2]
        if lines[above].strip():
            break
    return None, ""


def anchor_of(heading):
    """As code hosts make it; mkdocs makes the same of headings without special characters."""
    text = re.sub(r"\[([^\]]*)\]\([^)]*\)", r"\1", heading).replace("`", "").lower()
    return re.sub(r"[^\w\- ]", "", text).replace(" ", "-")


def documentation():
    """All pages, by path."""
    paths = [ROOT / "README.md", ROOT / "CONTRIBUTING.md", ROOT / "CHANGELOG.md"]
    paths += sorted((ROOT / "docs").rglob("*.md"))
    return {path: Page(path) for path in paths if path.exists()}
