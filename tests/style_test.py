#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""What script/check_style finds: a small tree with one fault each."""
import importlib.machinery
import importlib.util
import pathlib
import sys
import tempfile
import unittest

sys.dont_write_bytecode = True
SCRIPT = pathlib.Path(__file__).resolve().parent.parent / "script/check_style"
LOADER = importlib.machinery.SourceFileLoader("check_style", str(SCRIPT))
check_style = importlib.util.module_from_spec(importlib.util.spec_from_loader("check_style", LOADER))
LOADER.exec_module(check_style)

HEADER = "// Copyright the Waymark authors.\n// SPDX-License-Identifier: Apache-2.0\n"


class Style(unittest.TestCase):
    def setUp(self):
        folder = tempfile.TemporaryDirectory()
        self.addCleanup(folder.cleanup)
        self.root = pathlib.Path(folder.name)
        self.write("CMakeLists.txt", "foreach(module base map track\n    simulate)\nendforeach()\n")
        self.write("src/waymark/map/CMakeLists.txt", "waymark_module(map SOURCES map.cc TESTS map_test.cc\n"
                   "  LINK waymark_base\n  TEST_LINK opencv_core waymark_simulated_points)\n")
        self.write("src/waymark/simulate/CMakeLists.txt", "waymark_module(simulate SOURCES world.cc)\n"
                   "add_library(waymark_simulated_points STATIC testing/points.cc)\n")
        self.write("src/waymark/map/map.h", HEADER + '#include "waymark/base/id.h"\n\nstruct Map {\n  int size;\n};\n')

    def write(self, name, text):
        path = self.root / name
        path.parent.mkdir(parents=True, exist_ok=True)
        path.write_text(text)

    def complaints(self):
        return check_style.check(self.root)[1]

    def assert_found(self, *expected):
        self.assertEqual(self.complaints(), list(expected))

    def test_nothing(self):
        self.assertEqual(check_style.check(self.root), (1, []))

    def test_include_of_a_later_module(self):
        self.write("src/waymark/map/map.cc", HEADER + '#include "waymark/map/map.h"\n#include "waymark/track/tracker.h"\n')
        self.assert_found("src/waymark/map/map.cc:4: 'map' must not include 'track'")

    def test_tests_include_what_they_link(self):
        later = HEADER + '#include "waymark/track/tracker.h"\n#include "waymark/simulate/world.h"\n'
        self.write("src/waymark/map/map_test.cc", later)
        self.write("src/waymark/map/testing/random_map.h", later)
        self.write("src/waymark/map/random_map.h", later)
        self.assert_found("src/waymark/map/map_test.cc:3: 'map' must not include 'track'",
                          "src/waymark/map/random_map.h:3: 'map' must not include 'track'",
                          "src/waymark/map/random_map.h:4: 'map' must not include 'simulate'",
                          "src/waymark/map/testing/random_map.h:3: 'map' must not include 'track'")

    def test_unknown_module(self):
        self.write("src/waymark/mpa/mpa.h", HEADER)
        self.assert_found("src/waymark/mpa/mpa.h:1: 'mpa' is not among the modules of CMakeLists.txt")

    def test_type_defined_twice(self):
        for kind in ("struct Map {", "class Map : public Base {", "enum class Map : int { kOne };", "enum Map {",
                     "struct Map final {", "struct alignas(64) Map {", "template <class T>\nclass Map",
                     "template <class T> struct Map {};", "using Map = int;"):
            with self.subTest(kind):
                self.write("src/waymark/track/track.h", HEADER + kind + "\n")
                self.assertRegex("".join(self.complaints()),
                                 r"^src/waymark/track/track.h:[34]: a second type 'Map', the first is at "
                                 r"src/waymark/map/map.h:5$")

    def test_names_that_are_no_second_type(self):
        self.write("src/waymark/track/track.h", HEADER + "class Map;\nMap map();\nstruct Track {\n  struct Map {};\n};\n"
                   "struct std::hash<Map> {\n};\n")
        self.write("src/waymark/track/track.cc", HEADER + "using Map = int;\n")
        self.write("src/waymark/track/track_test.cc", HEADER + "struct Map {\n};\n")
        self.assert_found()

    def test_header_lock_and_lengths(self):
        self.write("src/waymark/map/map.cc", "std::mutex lock;\n")
        body = "void f() {\n" + "  g();\n" * 60 + "}\n"
        self.write("apps/main.cc", HEADER + body + "// Long because it lists.\n" + body)
        self.write("apps/long.cc", HEADER + "g();\n" * 400)
        self.assert_found("apps/long.cc:1: 403 lines, at most 400",
                          "apps/main.cc:3: a function of 62 lines, at most 60",
                          "src/waymark/map/map.cc:1: no licence header",
                          "src/waymark/map/map.cc:1: a lock outside the mailbox, the feed and the thread pool")


if __name__ == "__main__":
    unittest.main()
