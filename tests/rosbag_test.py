#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Bags that the real rosbag of ROS 1 (Debian's python3-rosbag) writes, and data bases as recorders of ROS 2 make them
with SQLite itself, give the images, times and trajectory of a folder with the same images.

Skipped where rosbag is not installed (script/setup python3-rosbag python3-sensor-msgs python3-roslz4)."""
import sqlite3
import struct
import unittest

import cv2

from cli_support import CliTest, waymark

try:
    import rosbag
    import rospy
    from sensor_msgs.msg import CameraInfo, CompressedImage, Image
except ImportError:
    rosbag = None

FIRST_NS = 1_700_000_000_000_000_000
STEP_NS = 50_000_000


class Cdr:
    """Serialises as XCDR1 does, little-endian (OMG DDS-XTypes 7.4.1)."""

    def __init__(self):
        self.bytes = b"\0\1\0\0"

    def add(self, kind, value):
        size = struct.calcsize(kind)
        self.bytes += b"\0" * (-(len(self.bytes) - 4) % size) + struct.pack("<" + kind, value)
        return self

    def text(self, value):
        self.add("I", len(value) + 1)
        self.bytes += value.encode() + b"\0"
        return self

    def data(self, value):
        self.add("I", len(value))
        self.bytes += value
        return self


def cdr_image(image, time_ns):
    height, width = image.shape
    message = Cdr().add("i", time_ns // 10**9).add("I", time_ns % 10**9).text("cam0").add("I", height).add("I", width)
    return message.text("mono8").add("B", 0).add("I", width).data(image.tobytes()).bytes


@unittest.skipUnless(rosbag, "rosbag is not installed (script/setup python3-rosbag python3-sensor-msgs)")
class Rosbag(CliTest):
    def setUp(self):
        super().setUp()
        self.source = self.sequence("mono")
        self.grey = [cv2.imread(str(path), cv2.IMREAD_GRAYSCALE) for path in self.images(self.source)]
        self.camera = self.source / "camchain.yaml"
        plain = self.folder / "plain"
        plain.mkdir()
        for i, image in enumerate(self.grey):
            cv2.imwrite(str(plain / f"{FIRST_NS + i * STEP_NS}.png"), image)
        self.expected = self.trajectory(plain)
        self.assertGreater(self.expected.count("\n"), 30)

    def trajectory(self, source, *options):
        done = self.run_on(source, "-c", self.camera, "--quiet", *options)
        self.assertEqual(done.returncode, 0, done.stderr)
        return (self.out / "trajectory.txt").read_text()

    def time_of(self, i):
        return rospy.Time(*divmod(FIRST_NS + i * STEP_NS, 10**9))

    def raw(self, i):
        message = Image(height=self.grey[i].shape[0], width=self.grey[i].shape[1], encoding="mono8",
                        step=self.grey[i].shape[1], data=self.grey[i].tobytes())
        message.header.stamp = self.time_of(i)
        return message

    def packed(self, i):
        message = CompressedImage(format="mono8; png compressed ", data=cv2.imencode(".png", self.grey[i])[1].tobytes())
        message.header.stamp = self.time_of(i)
        return message

    def write(self, compression, topic, message_of, info=None):
        path = self.folder / f"{compression}.bag"
        with rosbag.Bag(str(path), "w", compression=compression, chunk_threshold=400_000) as bag:
            for i in range(len(self.grey)):
                if info:
                    bag.write("/cam0/camera_info", info, self.time_of(i))
                bag.write(topic, message_of(i), self.time_of(i))
        return path

    def test_each_compression_gives_the_bits_of_the_folder(self):
        for compression, topic, message_of in (("none", "/cam0/image_raw", self.raw), ("bz2", "/cam0/image_raw", self.raw),
                                               ("lz4", "/cam0/image_raw/compressed", self.packed)):
            with self.subTest(compression):
                self.assertEqual(self.trajectory(self.write(compression, topic, message_of)), self.expected)

    def test_the_calibration_of_camera_info(self):
        info = CameraInfo(width=376, height=240, distortion_model="plumb_bob", D=[-0.2, 0.05, 0.0002, -0.0001, 0],
                          K=[290, 0, 187, 0, 291, 121, 0, 0, 1])
        done = self.run_on(self.write("none", "/cam0/image_raw", self.raw, info), "--quiet")
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertEqual((self.out / "trajectory.txt").read_text(), self.expected)

    def test_one_that_was_cut_off_gives_what_is_whole(self):
        path = self.write("none", "/cam0/image_raw", self.raw)
        path.write_bytes(path.read_bytes()[:path.stat().st_size * 2 // 3])
        done = waymark("info", path)
        self.assertEqual(done.returncode, 0, done.stderr)
        self.assertIn("cut off", done.stdout)
        self.assertEqual(self.run_on(path, "-c", self.camera).returncode, 0)
        self.assertGreater(len(self.frames()), 20)

    def test_sqlite_of_ros_2(self):
        path = self.folder / "walk.db3"
        with sqlite3.connect(path) as base:  # As rosbag2_storage_sqlite3 documents its tables.
            base.execute("CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL, "
                         "serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL)")
            base.execute("CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL, "
                         "timestamp INTEGER NOT NULL, data BLOB NOT NULL)")
            base.execute("CREATE INDEX timestamp_idx ON messages (timestamp ASC)")
            base.execute("INSERT INTO topics VALUES(1, '/cam0/image_raw', 'sensor_msgs/msg/Image', 'cdr', '')")
            for i, image in enumerate(self.grey):
                time_ns = FIRST_NS + i * STEP_NS
                base.execute("INSERT INTO messages(topic_id, timestamp, data) VALUES(1, ?, ?)",
                             (time_ns, cdr_image(image, time_ns)))
        base.close()
        self.assertEqual(self.trajectory(path), self.expected)


if __name__ == "__main__":
    unittest.main()
