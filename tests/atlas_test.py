#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Maps cut into tiles, put together again, and images found in them."""
import sqlite3
import unittest

from cli_support import NUM_FRAMES, CliTest, waymark


class Atlas(CliTest):
    def path(self, name):
        return self.folder / f"{name}.wmap"

    def make_map(self, name, source, *arguments):
        done = waymark("run", source, *arguments, "-o", self.folder / "run", "--map-out", self.path(name))
        self.assertEqual(done.returncode, 0, done.stderr)

    def task(self, *arguments):
        done = waymark(*arguments)
        self.assertEqual(done.returncode, 0, done.stderr)
        return done.stdout

    def rows(self, atlas, columns, table):
        base = sqlite3.connect(f"file:{atlas / 'atlas.db'}?mode=ro", uri=True)
        rows = base.execute(f"SELECT {columns} FROM {table}").fetchall()
        base.close()
        return rows

    def test_halves_become_one(self):
        source = self.sequence("stereo")
        self.make_map("a", source, "--frames", 26, "--keep-images")
        self.make_map("b", source, "--first", 14)
        atlas, other = self.folder / "atlas", self.folder / "other"
        self.assertIn("2 maps added", self.task("atlas", "add", atlas, self.path("a"), self.path("b"), "--keyframes", 8))
        self.assertIn("sound", self.task("atlas", "check", atlas))
        self.assertIn("1 connected part\n", self.task("atlas", "info", atlas))
        self.task("atlas", "add", other, self.path("b"), self.path("a"), "--keyframes", 8)
        for table in ("tile", "link", "shared"):
            self.assertEqual(self.rows(atlas, "*", table), self.rows(other, "*", table))
        self.assertIn("0 maps added", self.task("atlas", "add", atlas, self.path("a")))

        self.task("atlas", "optimize", atlas)
        self.assertIn("sound", self.task("atlas", "check", atlas))
        self.task("atlas", "export", atlas, "-o", self.path("whole"))
        self.assertIn("sound", self.task("map", "check", self.path("whole")))
        for order in ((), ("--unordered",)):
            done = waymark("localize", atlas, source, *order, "-o", self.out)
            self.assertEqual(done.returncode, 0, done.stderr)
            self.assertEqual(self.summary()["localized"], NUM_FRAMES)
            done = waymark("eval", self.out / "trajectory.txt", source / "groundtruth.txt", "--json")
            self.assertEqual(done.returncode, 0, done.stderr)

    def test_one_map_in_tiles(self):
        self.make_map("a", self.sequence("mono"))
        atlas = self.folder / "atlas"
        said = self.task("map", "tile", self.path("a"), "-o", atlas, "--keyframes", 8)
        self.assertIn("tiles", said)
        state = (atlas / "atlas.db").read_bytes()
        self.assertEqual(self.task("map", "tile", self.path("a"), "-o", atlas, "--keyframes", 8), said)
        self.assertEqual((atlas / "atlas.db").read_bytes(), state)
        self.task("atlas", "export", atlas, "-o", self.path("whole"))
        self.make_map("b", self.sequence("stereo"))
        self.assert_fails(waymark("map", "tile", self.path("b"), "-o", atlas), 2, "another map")
        # What is in metres gives its scale to what is not.
        self.assertIn("1 of 1 pairs", self.task("atlas", "add", atlas, self.path("b")))
        self.assertIn("1 connected part\n", self.task("atlas", "info", atlas))
        self.task("atlas", "export", atlas, "-o", self.path("both"))
        self.assertIn("in metres", self.task("map", "info", self.path("both")))

    def test_wrong_input(self):
        self.assert_fails(waymark("atlas", "info", self.folder), 2, "atlas.db")
        self.assert_fails(waymark("atlas", "add", self.folder / "atlas", self.path("no")), 2, "no.wmap")
        (self.folder / "file").write_text("x")
        self.assert_fails(waymark("atlas", "add", self.folder, self.folder / "file"), 2, "no atlas")
        self.make_map("a", self.sequence("mono"))
        atlas = self.folder / "tiled"
        self.task("map", "tile", self.path("a"), "-o", atlas)
        tile = next((atlas / "tiles").glob("*.wmap"))
        whole = tile.read_bytes()
        tile.write_bytes(whole[:-100])
        self.assert_fails(waymark("atlas", "check", atlas), 2, "faults")
        self.assert_fails(waymark("atlas", "export", atlas, "-o", self.path("out")), 2, tile.name)
        self.assertFalse(self.path("out").exists())
        tile.write_bytes(whole)
        base = sqlite3.connect(atlas / "atlas.db")
        base.execute("UPDATE tile SET scale = 0.0")
        base.commit()
        base.close()
        self.assert_fails(waymark("atlas", "info", atlas), 2, "atlas.db")


if __name__ == "__main__":
    unittest.main()
