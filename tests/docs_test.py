#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""What script/check_docs finds: one page with one fault each."""
import json
import os
import pathlib
import re
import sys
import tempfile
import unittest

from cli_support import CliTest

ROOT = pathlib.Path(__file__).resolve().parent.parent
sys.path.insert(0, str(ROOT / "script"))
from documentation.blocks import Failure, Runner  # noqa: E402
from documentation.chapters import check_chapters  # noqa: E402
from documentation.glossary import check_glossary  # noqa: E402
from documentation.header_examples import check_header_examples  # noqa: E402
from documentation.links import broken  # noqa: E402
from documentation.pages import Page, anchor_of  # noqa: E402


class Docs(unittest.TestCase):
    def setUp(self):
        (ROOT / "build").mkdir(exist_ok=True)
        folder = tempfile.TemporaryDirectory(prefix="docs_", dir=ROOT / "build")
        self.addCleanup(folder.cleanup)
        self.folder = pathlib.Path(folder.name)

    def page(self, text):
        path = self.folder / "page.md"
        path.write_text(text)
        return Page(path)

    def fault_of(self, text):
        """Of the one block of a page, or nothing."""
        program = self.folder / "waymark"
        program.write_text("#!/bin/sh\ncase $* in *cuont*) echo 'unknown key'; exit 2 ;; esac\necho 'valid: 1 cameras'\n")
        program.chmod(0o755)
        environment = {**os.environ, "PATH": f"{self.folder}:{os.environ['PATH']}"}
        page = self.page(text)
        self.assertEqual(len(page.blocks), 1)
        try:
            Runner(self.folder, environment).check(page.blocks[0])
        except Failure as failure:
            return str(failure)
        return None

    def test_commands(self):
        self.assertIsNone(self.fault_of("```sh\nwaymark config a.yaml\n```\n"))
        self.assertIn("status 2", self.fault_of("```sh\nwaymark config cuont\ntrue\n```\n"))
        self.assertIsNone(self.fault_of("<!-- status: 2 -->\n```sh\nwaymark config cuont\n```\n"))
        self.assertIsNone(self.fault_of("<!-- not run: takes long -->\n\n```sh\nwaymark config cuont\n```\n"))
        self.assertIn("reason", self.fault_of("<!-- not run: -->\n```sh\nfalse\n```\n"))
        self.assertIn("is a command", self.fault_of("```text\nwaymark config cuont\n```\n"))
        self.assertIn("language", self.fault_of("```\nwaymark config\n```\n"))

    def test_what_commands_print(self):
        self.assertIsNone(self.fault_of("```console\n$ waymark config a\nvalid: 2 cameras\n```\n"))
        self.assertIn("does not print", self.fault_of("```console\n$ waymark config a\nvalid: 2 lenses\n```\n"))

    def test_settings_and_data(self):
        self.assertIn("no JSON", self.fault_of("```json\n{\"a\": }\n```\n"))
        self.assertIsNone(self.fault_of("<!-- file: made.txt -->\n```text\nsomething\n```\n"))
        self.assertEqual((self.folder / "made.txt").read_text(), "something\n")

    def test_quotes(self):
        quoted = "<!-- from examples/map_images.cc -->\n```cpp\nSystem system(make_rig(*chain), {}, Timing::kLockstep);\n```\n"
        self.assertIn("no file", self.fault_of(quoted.replace("map_images", "nothing")))
        self.assertIn("not a part", self.fault_of(quoted.replace("*chain", "*other")))
        self.assertIsNone(self.fault_of(quoted.replace("{}", "Settings()")))
        self.assertIn("quoted", self.fault_of("```cpp\nint a;\n```\n"))

    def test_links(self):
        page = self.page("# A page\n\n## `a.csv` and more\n\n[x](gone.md) [y](#a-page) [z](#b) [w](http//x)\n")
        faults = {target: broken(page, target, {page.path: page}, set()) for _, target in page.links}
        self.assertEqual(list(faults), ["gone.md", "#a-page", "#b", "http//x"])
        self.assertIsNone(faults["#a-page"])
        for target in ("gone.md", "#b", "http//x"):
            self.assertIsNotNone(faults[target])
        self.assertEqual(anchor_of("`a.csv` and more"), "acsv-and-more")
        self.assertEqual(page.links[0][0], 5)

    def test_blocks_that_never_end(self):
        self.assertEqual(len(self.page("```sh\ntrue\n").faults), 1)


class Chapters(unittest.TestCase):
    """A small tree of two modules that share a chapter."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        self.write("CMakeLists.txt", "foreach(module simulate evaluate)")
        for name in ("simulate/world.h", "simulate/world.cc", "simulate/world_test.cc", "simulate/test_world.h",
                     "simulate/testing/town.h", "evaluate/chart-inl.h"):
            self.write(f"src/waymark/{name}", "")
        self.write("docs/conventions.md", "## Modules\n\n`simulate` `evaluate`\n")
        self.write("docs/how-it-works/simulate.md", "`world`, `chart`, `testing/town`, `inline`, `a.b`, `f()`\n")
        self.write("docs/decisions/simulate.md", "* `simulate/world`, `word`\n\n## 2026-11-21 · Then\n\n`simulate/gone`\n")

    def write(self, name, text):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")

    def test_what_is_named_is_there(self):
        self.assertEqual(check_chapters(self.root), [])
        self.write("docs/how-it-works/simulate.md", "`world.h`, `chart`\n\n`word`, `simulate/gone`\n```text\n`gone`\n```\n")
        self.write("docs/decisions/simulate.md", "* `evaluate/gone`\n")
        self.assertEqual(check_chapters(self.root),
                         ["docs/how-it-works/simulate.md:3: there is no file word",
                          "docs/how-it-works/simulate.md:3: there is no file simulate/gone",
                          "docs/decisions/simulate.md:1: there is no file evaluate/gone"])

    def test_what_is_there_is_named(self):
        self.write("src/waymark/evaluate/plot.cc", "")
        self.assertEqual(check_chapters(self.root), ["docs/how-it-works/simulate.md:1: does not name the file plot"])

    def test_modules_are_those_of_cmake(self):
        self.write("CMakeLists.txt", "foreach(module simulate evaluate view)")
        (self.root / "src/waymark/view").mkdir()
        self.assertEqual(check_chapters(self.root), ["docs/how-it-works/view.md:1: is missing",
                                                     "docs/conventions.md:1: the modules are not those of CMakeLists.txt in their order"])


class Glossary(unittest.TestCase):
    """A small tree of one module, one header of which is public."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        self.write("docs/concepts.md", "A **widget**.\n\n## Glossary\n\n* **sub-map**, **Sim(3)**: a gadget.\n\n## More\n\n**gizmo**\n")
        self.write("script/documentation/terms.txt", "# Words.\n\nclass\nkeeper\nreader\n")
        self.write("cmake/WaymarkPublicHeaders.cmake",
                   "execute_process(COMMAND ${CMAKE_COMMAND} -E echo waymark/map/submap_reader.h)")
        self.write("src/waymark/map/submap_reader.h",
                   "class Widget;\nclass SubmapReader final : public Reader {\n public:\n  enum class Class { kA };\n"
                   " private:\n  struct Shelf {};\n};\n\ntemplate <typename T>\nstruct Sim3Keeper {\n")
        for name in ("readers-inl.h", "readers_test.cc", "testing/gizmo.h"):
            self.write(f"src/waymark/map/{name}", "struct Gizmo {\n")

    def write(self, name, text):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")

    def test_words_of_glossary_and_list_pass(self):
        self.assertEqual(check_glossary(self.root), [])

    def test_other_words_are_named(self):
        self.write("src/waymark/map/gizmo_keeper.cc", "")
        self.write("src/waymark/map/submap_reader.h", "\nenum class RGBDWidget : int { kA };\n")
        where = "is neither in the glossary of docs/concepts.md nor in script/documentation/terms.txt"
        self.assertEqual(check_glossary(self.root),
                         [f"src/waymark/map/gizmo_keeper.cc:1: gizmo of gizmo_keeper {where}",
                          f"src/waymark/map/submap_reader.h:2: rgbd of RGBDWidget {where}",
                          f"src/waymark/map/submap_reader.h:2: widget of RGBDWidget {where}"])

    def test_list_is_sorted(self):
        self.write("script/documentation/terms.txt", "keeper\nreader\nclass\n")
        self.assertEqual(check_glossary(self.root),
                         ["script/documentation/terms.txt:3: class is not in its place, expected sorted words"])


class HeaderExamples(unittest.TestCase):
    """A small tree of two public headers."""

    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        self.write("cmake/WaymarkPublicHeaders.cmake", "set(roots\n  map/map.h # values\n  map/rig.h)\n")
        types = "".join(f"struct {name} {{}};\n" for name in "Input System Viewer FrameImages Map Settings".split())
        self.write("src/waymark/map/map.h", f"#pragma once\n\n// A map.\n//\n//   Map other = map;\n\nnamespace waymark {{\n{types}}}\n")
        self.write("src/waymark/map/rig.h", "#pragma once\n\n// A rig.\n\nnamespace waymark { struct Rig {}; }\n")

    def write(self, name, text):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text, encoding="utf-8")

    def test_header_without_one_is_named(self):
        self.assertIn("src/waymark/map/rig.h:1: does not open with an example of its use", check_header_examples(self.root))

    def test_what_does_not_compile_is_named(self):
        self.write("src/waymark/map/rig.h", "#pragma once\n\n// A rig.\n//\n//   Rig other = rig;\n\nnamespace waymark { struct Rig {}; }\n")
        self.assertEqual(check_header_examples(self.root), [])
        self.write("src/waymark/map/rig.h", "#pragma once\n\n// A rig.\n//\n//   other = rig;\n\nnamespace waymark { struct Rig {}; }\n")
        self.assertRegex(check_header_examples(self.root)[0], r"^map/rig.h, example:1:1: error: .*other.*")


class Results(CliTest):
    """docs/results.md has every column, key, state and reason, and no others."""

    def tables(self):
        """The names in the first cells of each table, by the table's head."""
        found, head = {}, None
        lines = (ROOT / "docs" / "results.md").read_text().split("\n")
        for line, below in zip(lines, lines[1:]):
            if below.startswith("|---"):
                head = found.setdefault(line, set())
            elif line.startswith("| `"):
                head.update(re.findall(r"`(\w+)`", line.split(" | ")[0]))
        return found

    def names_of(self, kind):
        """What to_string() gives for an enum of base/frame_state.h."""
        source = (ROOT / "src/waymark/base/frame_state.cc").read_text()
        return set(re.findall(rf"case {kind}::\w+:\s*return \"(\w+)\";", source))

    def test_page_and_program_agree(self):
        self.assertEqual(self.run_on(self.sequence("stereo")).returncode, 0)
        tables = self.tables()
        columns = set((self.out / "frames.csv").read_text().split("\n")[0].split(","))
        self.assertEqual(tables["| column | meaning |"], columns | {"name"})
        keys = set(json.loads((self.out / "summary.json").read_text()))
        self.assertEqual(tables["| key | meaning |"], keys | {"calibration", "refined_calibration", "localized", "markers", "scales", "imu"})
        self.assertEqual(tables["| state | meaning |"], self.names_of("FrameState"))
        self.assertEqual(tables["| reason | meaning |"], self.names_of("FrameReason") - {"none"})


class Advice(unittest.TestCase):
    """The table of advice and docs/troubleshooting.md."""

    def test_each_cause_has_its_section(self):
        source = (ROOT / "src/waymark/report/advice.cc").read_text()
        table = source[source.index("kCauses = {"):]
        sections = re.findall(r"AdviceCause\{.*?\"([a-z-]+)\"\}", table, re.DOTALL)
        self.assertEqual(len(sections), table.count("AdviceCause{"))
        self.assertGreater(len(sections), 10)
        anchors = Page(ROOT / "docs/troubleshooting.md").anchors()
        for section in sections:
            self.assertIn(section, anchors)


if __name__ == "__main__":
    unittest.main()
