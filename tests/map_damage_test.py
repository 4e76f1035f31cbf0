#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Map files that are damaged or made to do harm: each is refused with one line that says where,
what, and what was expected."""
import copy
import math
import random
import resource
import struct
import unittest

import map_records
from cli_support import CliTest, waymark

GIGANTIC = b"\xff\xff\xff\xf0"


def first(records, kind, number=0):
    return [record for record in records if record.get("kind") == kind][number]


def place(records, kind, number=0):
    return [i for i, record in enumerate(records) if record.get("kind") == kind][number]


def put(array, index, code, value):
    """One element of an array record."""
    size = struct.calcsize(code)
    data = bytearray(array["data"])
    data[size * index:size * (index + 1)] = struct.pack("<" + code, value)
    array["data"] = bytes(data)


def limit_memory():
    resource.setrlimit(resource.RLIMIT_AS, (2**30, 2**30))


class MapDamage(CliTest):
    """Each kind: its name, what the error has to say, and what is done to the records, in place or
    with what it returns in their stead."""

    def kinds(self):
        yield "other version", "has version 7, expected 1", lambda r: r[0].update(version=7)
        yield "other format", "is no map file", lambda r: r[0].update(format="waymark-mop")
        yield "a number for a text", "", lambda r: r[0].update(producer=3)
        yield "no header", "", lambda r: r.pop(0)
        yield "no end", "is truncated", lambda r: r.pop()
        yield "more after the end", "goes on after its end", lambda r: r.append(r[1])
        yield "two maps in a row", "goes on after its end", lambda r: r.extend(copy.deepcopy(r))
        yield "keyframe twice", "", lambda r: r.insert(place(r, "keyframe"), first(r, "keyframe"))
        yield "keyframe missing", "", lambda r: r.pop(place(r, "keyframe", 1))
        yield "landmarks missing", "", lambda r: r.pop(place(r, "landmarks"))
        yield "camera missing", "", lambda r: r.pop(place(r, "camera"))
        yield "out of order", "", lambda r: r.reverse()
        yield "unknown kind", "has the kind 'king'", lambda r: r[3].update(kind="king")
        yield "unknown key", "has the key 'x', expected none", lambda r: r[3].update(x=1)
        yield "missing key", "has no pixel", lambda r: first(r, "keyframe").pop("pixel")
        yield "wrong counts", "", lambda r: r[-1]["counts"].update(keyframe=1)
        yield "wrong type", "", lambda r: first(r, "keyframe").update(frame="one")
        yield "no id", "", lambda r: first(r, "keyframe").update(id=None)
        yield "negative id", "", lambda r: first(r, "keyframe").update(id=-1)
        yield "many ids", "end_landmark", lambda r: first(r, "map").update(end_landmark=2**40)
        yield "cyclic parents", "cycle", self.cyclic_parents
        yield "parent that is gone", "parent", lambda r: first(r, "keyframe", 1).update(parent=2**20)
        yield "sub-map in itself", "", lambda r: first(r, "submap").update(joined_into=0, root=None)
        yield "NaN pose", "rig_from_world is nan, expected finite", self.pose("translation", math.nan)
        yield "infinite pose", "rig_from_world is inf", self.pose("translation", math.inf)
        yield "no rotation", "expected a unit quaternion", self.pose("rotation", 9.0)
        yield "NaN landmark", "position_in_world holds nan", self.element(
            "landmarks", "position_in_world", 4, "d", math.nan)
        yield "NaN pixel", "pixel holds nan", self.element("keyframe", "pixel", 3, "f", math.nan)
        yield "pixel outside", "pixel of feature 1", self.element("keyframe", "pixel", 2, "f", 1e4)
        yield "level too high", "level of feature 5 is 9", self.element("keyframe", "level", 5, "B", 9)
        yield "landmark not there", "is not there", self.element(
            "keyframe", "landmark", 0, "I", 2**27)
        yield "partner not there", "partner", self.element("keyframe", "partner", 1, "I", 2**31)
        yield "another dtype", "has the dtype '<f8'", lambda r: first(r, "keyframe")["pixel"].update(
            dtype="<f8")
        yield "another shape", "", lambda r: first(r, "keyframe")["pixel"].update(shape=[2**40, 2])
        yield "shape of overflow", "", lambda r: first(r, "keyframe")["pixel"].update(
            shape=[2**63, 2])
        yield "focal length", "focal length fu is -1", lambda r: first(r, "camera")[
            "intrinsics"].__setitem__(0, -1.0)
        yield "unknown camera", "camera_model is eye?ball", lambda r: first(r, "camera").update(
            camera_model="eye\nball")
        yield "gigantic image size", "width_px", lambda r: first(r, "camera").update(width_px=2**62)
        yield "gigantic image", "is 60000x60000 px, expected at most", self.gigantic_image
        yield "duplicated key", "has the key 'frame' twice", self.duplicated_key
        yield "deep nesting", "too deep", lambda r: [r[0], b"\x91" * 100000 + b"\x01"]
        for name, code in (("list", b"\xdd"), ("map", b"\xdf"), ("text", b"\xdb"), ("bytes", b"\xc6")):
            yield f"gigantic {name}", "", lambda r, code=code: [r[0], code + GIGANTIC]

    @staticmethod
    def cyclic_parents(records):
        first(records, "keyframe", 1)["parent"] = 2
        first(records, "keyframe", 2)["parent"] = 1

    @staticmethod
    def gigantic_image(records):
        jpeg = b"\xff\xd8\xff\xc0\x00\x11\x08" + struct.pack(">HH", 60000, 60000) + bytes(10) + b"\xff\xd9"
        records.insert(-1, {"kind": "image", "id": first(records, "keyframe")["id"], "jpeg": jpeg})
        records[-1]["counts"]["image"] = 1

    @staticmethod
    def duplicated_key(records):
        at = place(records, "keyframe")
        records[at] = map_records.pack_pairs([*records[at].items(), ("frame", 3)])

    @staticmethod
    def pose(part, value):
        return lambda r: first(r, "keyframe", 1)["rig_from_world"][part].__setitem__(0, value)

    @staticmethod
    def element(kind, key, index, code, value):
        return lambda r: put(first(r, kind)[key], index, code, value)

    def setUp(self):
        super().setUp()
        self.map = self.folder / "map.wmap"
        done = self.run_on(self.sequence("stereo"), "--frames", 30, "--map-out", self.map)
        self.assertEqual(done.returncode, 0, done.stderr)

    def refuse(self, name, data, expected):
        self.map.write_bytes(data)
        done = waymark("map", "info", self.map, preexec_fn=limit_memory)
        with self.subTest(name):
            self.assertEqual(done.returncode, 2, done.stdout + done.stderr)
            self.assertEqual(done.stdout, "")
            self.assertRegex(done.stderr, r"\Aerror: [^\n]*map\.wmap: [^\n]*expected [^\n]*\n\Z")
            self.assertIn(expected, done.stderr)
            self.assertLess(len(done.stderr), 1500)

    def test_damaged_records(self):
        whole = map_records.split(self.map.read_bytes())
        packed = [map_records.join([record]) for record in whole]

        def join(records):  # What is as it was is not packed again.
            return map_records.join(
                packed[whole.index(record)] if record in whole else record for record in records)

        self.map.write_bytes(join(whole))
        self.assertIn("sound", waymark("map", "check", self.map).stdout)
        num_kinds = 0
        for name, expected, inflict in self.kinds():
            records = copy.deepcopy(whole)
            instead = inflict(records)
            records = instead if isinstance(instead, list) else records
            self.refuse(name, join(records), expected)
            num_kinds += 1
        self.assertGreaterEqual(num_kinds, 40)

    def test_ids_that_were_used_up_cost_no_memory(self):
        records = map_records.split(self.map.read_bytes())
        first(records, "map").update(end_landmark=2**28)
        self.map.write_bytes(map_records.join(records))
        for command in (["info"], ["check"], ["align", "--up", "0,0,1", "-o", self.folder / "up.wmap"]):
            done = waymark("map", command[0], self.map, *command[1:], preexec_fn=limit_memory)
            self.assertEqual(done.returncode, 0, done.stderr)

    def test_control_characters_stay_out_of_the_terminal(self):
        records = map_records.split(self.map.read_bytes())
        records[0]["producer"] = "\x1b[31mred\x07\r\n\x7f\x9b"
        self.map.write_bytes(map_records.join(records))
        done = waymark("map", "info", self.map)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("written by \\x1b[31mred\\x07\\x0d\\x0a\\x7f\\xc2\\x9b,", done.stdout)

    def test_damaged_bytes(self):
        whole, rng = self.map.read_bytes(), random.Random(3)
        self.refuse("empty", b"", "is truncated")
        self.refuse("text", b"A text, which is no map.\n", "is no map file")
        self.refuse("noise", rng.randbytes(5000), "")
        self.refuse("zeros", bytes(5000), "")
        self.refuse("another byte at the end", whole + b"\0", "goes on after its end")
        self.refuse("first byte gone", whole[1:], "")
        for _ in range(8):
            self.refuse("truncated", whole[:rng.randrange(len(whole))], "is truncated")
            flipped = bytearray(whole)
            flipped[rng.randrange(len(whole))] ^= 1 << rng.randrange(8)
            self.refuse("flipped bit", bytes(flipped), "")
            block = bytearray(whole)
            at = rng.randrange(len(whole) - 512)
            block[at:at + 512] = 512 * b"\xa5"
            self.refuse("another sector", bytes(block), "")
            cut = bytearray(whole)
            del cut[at:at + 1 + rng.randrange(400)]
            self.refuse("bytes gone from the middle", bytes(cut), "")


if __name__ == "__main__":
    unittest.main()
