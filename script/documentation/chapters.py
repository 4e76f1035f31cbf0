# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Whether the chapters of how-it-works name the files of their modules, and chapters and decisions no others."""
import re

from documentation.pages import FENCE, ROOT

CODE = re.compile(r"`([^`\n]+)`")
FILE = re.compile(r"[a-z]\w*(?:(?:/[a-z]\w*)+(?:\.\w+)?|(?:\.(?:h|cc))?)")
CHAPTER_OF = {"evaluate": "simulate"}  # Those that have no chapter of their own.
WORDS = {"inline", "lockstep", "realtime", "map_latency", "global_latency"}  # Of settings.
FIRST_ENTRY = re.compile(r"^## 2\d\d\d-\d\d-\d\d ")  # What is below was true then.


def modules_in_order(root):
    return re.search(r"foreach\(module\s+([\w\s]+)\)", (root / "CMakeLists.txt").read_text(encoding="utf-8"))[1].split()


def files_of(folder):
    """The names of a module's files, without those of tests."""
    return {path.stem.removesuffix("-inl") for path in folder.iterdir()
            if path.suffix in (".h", ".cc") and "test" not in path.stem}


def code_in(path):
    """Yields (line, text) of what is in `code`, up to the first entry of a log."""
    is_block = False
    for number, line in enumerate(path.read_text(encoding="utf-8").split("\n"), 1):
        if FIRST_ENTRY.match(line):
            return
        is_block ^= bool(FENCE.match(line))
        if not is_block:
            yield from ((number, code) for code in CODE.findall(line))


def exists(root, folders, name):
    """Whether a name, with or without its ending, is a file or folder in one of the folders."""
    return any((folder / (name + ending)).exists() for folder in folders for ending in ("", ".h", ".cc", "-inl.h"))


def check_chapter(root, path, modules):
    """The complaints about the chapter of these modules, or about a page that is of none."""
    sources, named, faults = root / "src" / "waymark", set(), []
    folders = [sources / module for module in modules]
    for line, code in code_in(path):
        if not FILE.fullmatch(code) or code in WORDS or not (modules or "/" in code):
            continue
        named.add(re.sub(r"\.(h|cc)$", "", code))
        if not exists(root, [*folders, sources, root], code):
            faults.append(f"{path.relative_to(root)}:{line}: there is no file {code}")
    missing = sorted(name for folder in folders for name in files_of(folder) - named)
    return faults + [f"{path.relative_to(root)}:1: does not name the file {name}" for name in missing]


def check_chapters(root=ROOT):
    order, docs, faults = modules_in_order(root), root / "docs", []
    for path in sorted((docs / "how-it-works").glob("*.md")):
        faults += check_chapter(root, path, [module for module in order if CHAPTER_OF.get(module, module) == path.stem])
    faults += [f"docs/how-it-works/{module}.md:1: is missing" for module in order
               if not (docs / "how-it-works" / f"{CHAPTER_OF.get(module, module)}.md").exists()]
    for path in sorted((docs / "decisions").glob("*.md")):
        faults += check_chapter(root, path, [])
    listed = re.search(r"^## Modules\n(.*)", (docs / "conventions.md").read_text(encoding="utf-8"), re.M | re.S)
    if re.findall(r"^`\w.*`$", listed[1], re.M) != [" ".join(f"`{module}`" for module in order)]:
        faults.append("docs/conventions.md:1: the modules are not those of CMakeLists.txt in their order")
    return faults
