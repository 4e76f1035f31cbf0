# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Whether each public header opens with code that shows how its types are used, and that compiles."""
import re
import subprocess
import tempfile

from documentation.pages import ROOT

HEAD = re.compile(r"#pragma once\n\n((?://.*\n)+)")
# What an example takes as it comes.
PARAMETERS = ("Input& input, System& system, Viewer& viewer, const FrameImages& images, const Map& map, const Rig& rig, "
              "const Settings& settings")


def public_roots(root):
    listed = (root / "cmake" / "WaymarkPublicHeaders.cmake").read_text(encoding="utf-8")
    return re.findall(r"^  (\w\S*\.h)", listed[listed.index("set(roots"):], re.M)


def example_of(root, header):
    """The code in the comment that a header opens with; empty where there is none."""
    head = HEAD.search((root / "src" / "waymark" / header).read_text(encoding="utf-8"))
    lines = head[1].split("\n") if head else []
    return "".join(line[5:] + "\n" for line in lines if line.startswith("//   ") or line == "//").strip("\n")


def as_program(examples):
    """One translation unit: types and tests in a namespace, statements in a function."""
    parts = ["#include <cstdio>\n#include <iostream>\n"]
    parts += [f'#include "waymark/{header}"\n' for header in examples]
    for number, (header, code) in enumerate(examples.items()):
        is_declaration = re.match(r"struct |TEST", code)
        before, after = ("", "") if is_declaration else (f"[[maybe_unused]] void use({PARAMETERS}) {{\n", "\n}")
        parts.append(f'namespace waymark::example_{number} {{\n{before}#line 1 "{header}, example"\n{code}{after}\n}}\n')
    return "".join(parts)


def check_header_examples(root=ROOT):
    examples = {header: example_of(root, header) for header in public_roots(root)}
    faults = [f"src/waymark/{header}:1: does not open with an example of its use"
              for header, code in examples.items() if not code]
    with tempfile.NamedTemporaryFile("w", suffix=".cc") as file:
        file.write(as_program(examples))
        file.flush()
        compiled = subprocess.run(["g++", "-std=c++20", "-fsyntax-only", f"-I{root / 'src'}", "-isystem", "/usr/include/eigen3",
                                   "-isystem", "/usr/include/opencv4", file.name], capture_output=True, text=True, check=False)
    return faults + [line for line in compiled.stderr.split("\n") if ": error: " in line]
