# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""A hook of mkdocs: links that leave docs/ (to sources, to the README at the root) become plain text in the
site, and code blocks lose the comments that script/check_docs reads."""
import pathlib
import re

DOCS = pathlib.Path(__file__).resolve().parent.parent.parent / "docs"
LINK = re.compile(r"(?<!!)\[((?:[^\[\]]|\[[^\]]*\])*)\]\(([^()\s]+)\)")
MARKER = re.compile(r"^ *<!-- (not run|synopsis|from|file|run|status)\b.*-->\n", re.MULTILINE)


def on_page_markdown(markdown, page, **_):
    folder = (DOCS / page.file.src_path).parent

    def keep_or_drop(match):
        text, target = match[1], match[2].partition("#")[0]
        if not target or "://" in target:
            return match[0]
        path = (folder / target).resolve()
        if DOCS in path.parents and path.is_file():
            return match[0]
        return f"`{text}`" if re.search(r"[./]", text) and "`" not in text else text

    return MARKER.sub("", LINK.sub(keep_or_drop, markdown))
