# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Whether all links lead somewhere. Those to other sites are checked for their form only."""
import re
import urllib.parse

from documentation.pages import ROOT

WEB = re.compile(r"^(https?://[\w.-]+(:\d+)?(/[^\s<>\"]*)?|mailto:[\w.+-]+@[\w.-]+)$")


def check_links(pages):
    faults = [fault for page in pages.values() for fault in page.faults]
    reached = set()
    for page in pages.values():
        for line, target in page.links:
            fault = broken(page, target, pages, reached)
            if fault:
                faults.append(f"{page.path.relative_to(ROOT)}:{line}: link to {target}: {fault}")
    docs, site = ROOT / "docs", (ROOT / "mkdocs.yml").read_text(encoding="utf-8")
    for path in pages:
        if docs in path.parents and f" {path.relative_to(docs)}\n" not in site:
            faults.append(f"{path.relative_to(ROOT)}:1: is missing in the table of contents in mkdocs.yml")
        if docs in path.parents and path not in reached and path != docs / "README.md":
            faults.append(f"{path.relative_to(ROOT)}:1: no other page links to it")
    return faults


def broken(page, target, pages, reached):
    """What is wrong with a link, or nothing."""
    if "://" in target or target.startswith("mailto:"):
        return None if WEB.match(target) else "is malformed"
    file, _, anchor = target.partition("#")
    path = page.path if not file else (page.path.parent / urllib.parse.unquote(file)).resolve()
    if not path.exists():
        return "there is no such file"
    if ROOT not in path.parents and path != ROOT:
        return "leads out of the repository"
    if path != page.path:
        reached.add(path)
    if not anchor:
        return None
    if path.suffix != ".md":
        return None if re.fullmatch(r"L\d+(-L\d+)?", anchor) else "only pages have anchors"
    if path not in pages or anchor not in pages[path].anchors():
        return f"the page has no heading '{anchor}'"
    return "the heading has '--', which code hosts and mkdocs name differently" if "--" in anchor else None
