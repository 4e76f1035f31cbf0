# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Whether the names of source files and public types are made of known words: those in bold in the glossary of
docs/concepts.md, and those of terms.txt."""
import re
import subprocess

from documentation.pages import ROOT

TERMS = "script/documentation/terms.txt"
SECTION = re.compile(r"^## Glossary\n(.*?)(?=^## |\Z)", re.M | re.S)
BOLD = re.compile(r"\*\*(.+?)\*\*")
WORD = re.compile(r"[A-Z]+(?![a-z])|[A-Z]?[a-z]+")
TYPE = re.compile(r"\s*(?:template <.*>\s*)?(?:struct|class|union|enum(?: class)?) (?:alignas\(.*?\) )?([A-Z]\w*)(?: final)?\s*"
                  r"(?::[^:].*|\{.*)?$")
ACCESS = re.compile(r" (public|protected|private):$")


def words_of(name):
    return [word.lower() for word in WORD.findall(name)]


def glossary(root):
    """The words of the terms; those of sub-map are also submap."""
    section = SECTION.search((root / "docs" / "concepts.md").read_text(encoding="utf-8"))
    terms = BOLD.findall(section[1]) if section else []
    return {word for term in terms for text in (term, term.replace("-", "")) for word in words_of(text)}


def read_terms(root):
    """The words, and what is wrong with the list."""
    words, faults, before = set(), [], ""
    for line, text in enumerate((root / TERMS).read_text(encoding="utf-8").split("\n"), 1):
        word = text.partition("#")[0].strip()
        if word:
            if word <= before:
                faults.append(f"{TERMS}:{line}: {word} is not in its place, expected sorted words")
            words.add(word)
            before = word
    return words, faults


def file_names(root):
    """Yields (file, line, name) of the files of the modules, without those of tests."""
    for path in sorted((root / "src" / "waymark").glob("*/*")):
        if path.suffix in (".h", ".cc") and "test" not in path.stem:
            yield path.relative_to(root), 1, path.stem.removesuffix("-inl")


def public_types(root):
    """Yields (file, line, name) of the types that a user's program may name."""
    listed = subprocess.run(["cmake", "-P", root / "cmake" / "WaymarkPublicHeaders.cmake"],
                            capture_output=True, text=True, check=True).stdout
    for header in listed.split():
        is_private = False
        for line, text in enumerate((root / "src" / header).read_text(encoding="utf-8").split("\n"), 1):
            access, found = ACCESS.match(text), TYPE.match(text)
            is_private = access[1] == "private" if access else is_private and text[:1] in ("", " ")
            if found and not is_private:
                yield f"src/{header}", line, found[1]


def is_among(word, words):
    """Whether it is one of the words, or the plural of one."""
    return not words.isdisjoint((word, word.removesuffix("s"), word.removesuffix("es")))


def check_glossary(root=ROOT):
    terms, faults = read_terms(root)
    known = glossary(root) | terms
    return faults + [f"{file}:{line}: {word} of {name} is neither in the glossary of docs/concepts.md nor in {TERMS}"
                     for file, line, name in (*file_names(root), *public_types(root))
                     for word in words_of(name) if not is_among(word, known)]
