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
        self.assertEqual(tables["| column | meaning |"], set((self.out / "frames.csv").read_text().split("\n")[0].split(",")))
        keys = set(json.loads((self.out / "summary.json").read_text()))
        self.assertEqual(tables["| key | meaning |"], keys | {"calibration", "refined_calibration", "localized", "markers", "scales"})
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
