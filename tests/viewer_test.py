#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""The viewer's server: what clients see of a running session, what they can do, and that nobody on its port does harm."""
import json
import random
import re
import signal
import socket
import subprocess
import urllib.error
import urllib.parse
import urllib.request
import unittest

from cli_support import PROGRAM, CliTest, waymark
from viewer_client import Refused, ViewerClient


class ViewerTest(CliTest):
    def setUp(self):
        super().setUp()
        self.process = None
        self.map = self.folder / "map.wmap"

    def tearDown(self):
        if self.process and self.process.poll() is None:
            self.process.kill()
        if self.process:
            self.process.communicate()
        super().tearDown()

    def connect(self, url):
        client = ViewerClient(url)
        self.addCleanup(client.close)
        return client

    def start(self, *arguments):
        """Starts the program; the URL that it prints."""
        self.process = subprocess.Popen([PROGRAM, *map(str, arguments)], stdout=subprocess.PIPE,
                                        stderr=subprocess.STDOUT, text=True)
        self.printed = ""
        for line in self.process.stdout:
            self.printed += line
            if found := re.search(r"open (http://\S+) in a browser", line):
                return found[1]
        raise AssertionError(self.printed)

    def run_with_viewer(self, *more, setup="stereo", pace=0.25, address="0"):
        source = self.sequence(setup)
        camera = ["-c", source / "camchain.yaml"] if (source / "camchain.yaml").exists() else []
        return self.start("run", source, *camera, "-o", self.out, "--pace", pace, "--viewer", address, *more)

    def end(self, expected=0):
        printed, _ = self.process.communicate(timeout=120)
        self.assertEqual(self.process.returncode, expected, self.printed + printed)


class Session(ViewerTest):
    def test_clients_see_what_the_engine_has(self):
        client = self.connect(self.run_with_viewer())
        client.wait_for(lambda c: c.is_complete and c.hello["setup"] == "stereo")
        self.assertEqual(client.hello["mode"], "live")
        client.wait_for(lambda c: c.holds_what_status_says() and c.status["keyframes"] > 0)
        self.assertGreater(client.status["landmarks"], 0)
        client.wait_for(lambda c: c.status["frame"] >= 25 and c.holds_what_status_says())
        late = self.connect(client.url)
        late.wait_for(lambda c: c.holds_what_status_says())
        self.assertGreaterEqual(len(late.frames), 25)
        self.assertGreater(client.num_frames_shown, 0)
        client.wait_for(lambda c: c.status["phase"] == "done" and c.holds_what_status_says())
        self.end()
        summary = self.summary()
        self.assertEqual(client.status["landmarks"], summary["landmarks"])
        self.assertEqual(client.status["keyframes"], summary["keyframes"])
        self.assertEqual(client.status["tracked"], summary["tracked"])
        self.assertEqual(len(client.frames), summary["frames"])

    def test_every_control_works(self):
        client = self.connect(self.run_with_viewer("--map-out", self.map, pace=0.1))
        client.wait_for(lambda c: c.is_complete and c.status["frame"] is not None and c.status["keyframes"] > 0)
        self.assertTrue(client.ask("pause")["ok"])
        client.wait_for(lambda c: c.status["phase"] == "paused")
        paused = client.status["frames"]
        saved = client.ask("save")
        self.assertTrue(saved["ok"], saved)
        self.assertEqual(saved["path"], str(self.map))
        self.assertEqual(waymark("map", "check", self.map).returncode, 0)
        client.wait_for(lambda c: c.texts[-1] is c.status)
        self.assertLessEqual(client.status["frames"], paused + 1)

        self.assertTrue(client.ask("mapping", on=False)["ok"])
        self.assertTrue(client.ask("resume")["ok"])
        client.wait_for(lambda c: c.status["phase"] == "running" and c.status["frames"] > paused + 3)
        self.assertFalse(client.status["is_mapping"])
        client.ask("mapping", on=True)
        client.wait_for(lambda c: c.status["is_mapping"])

        generation = client.generation
        self.assertTrue(client.ask("reset")["ok"])
        client.wait_for(lambda c: c.generation > generation and c.is_complete)
        client.wait_for(lambda c: c.status["keyframes"] > 0 and c.holds_what_status_says())

        keyframe = client.ask("keyframe", id=min(client.keyframes))
        self.assertEqual(keyframe["type"], "keyframe")
        landmark = client.ask("landmark", id=keyframe["landmarks"][0])
        self.assertIn(keyframe["id"], [o["keyframe"] for o in landmark["observations"]])
        self.assertFalse(client.ask("landmark", id=4000000000)["ok"])
        self.assertFalse(client.ask("format")["ok"])

        self.assertTrue(client.ask("stop")["ok"])
        self.end()
        self.assertEqual(waymark("map", "check", self.map).returncode, 0)

    def test_the_page_is_there_while_the_calibration_is_found(self):
        client = self.connect(self.start("run", self.image_folder(), "-o", self.out, "--viewer", "0", "--pace", "0.1", "--frames", "20"))
        client.wait_for(lambda c: c.status and c.status["doing"].startswith("calibration"))
        self.assertEqual((client.status["phase"], client.status["frames"]), ("starting", 0))
        self.assertIn("no session yet", client.ask("pause")["error"])
        client.wait_for(lambda c: c.status["doing"] == "" and c.status["frames"] > 0, seconds=300)
        self.assertEqual(client.hello["setup"], "mono")
        self.assertTrue(client.ask("stop")["ok"])
        self.process.communicate(timeout=120)

    def test_a_calibration_ends_when_it_is_told_to(self):
        client = self.connect(self.start("run", self.image_folder(), "-o", self.out, "--viewer", "0"))
        client.wait_for(lambda c: c.status and c.status["doing"].startswith("calibration"))
        self.assertTrue(client.ask("stop")["ok"])
        self.end(expected=3)
        self.assertEqual(self.summary()["frames"], 0)

    def test_ctrl_c_ends_a_paused_session(self):
        client = self.connect(self.run_with_viewer())
        client.wait_for(lambda c: c.status and c.status["frame"] is not None)
        client.ask("pause")
        self.process.send_signal(signal.SIGINT)
        self.end()
        self.assertGreater(self.summary()["tracked"], 0)

    def test_a_session_may_end_right_after_it_began_anew(self):
        client = self.connect(self.run_with_viewer())
        client.wait_for(lambda c: c.status and c.status["tracked"] > 0)
        for request in ("pause", "reset", "stop"):
            client.ask(request)
        self.end()
        self.assertEqual((self.out / "trajectory.txt").read_text(), "")
        self.assertEqual(self.summary()["keyframes"], 0)

    def test_a_saved_map_has_the_same_page(self):
        self.assertEqual(self.run_on(self.sequence("stereo"), "--map-out", self.map).returncode, 0)
        url = self.start("view", self.map, "--port", "0")
        client = self.connect(url)
        client.wait_for(lambda c: c.holds_what_status_says())
        self.assertEqual(client.hello["mode"], "map")
        self.assertEqual(client.hello["controls"], [])
        self.assertEqual(client.status["landmarks"], self.summary()["landmarks"])
        self.assertFalse(client.ask("reset")["ok"])
        with urllib.request.urlopen(url, timeout=20) as page:
            self.assertIn("text/html", page.headers["Content-Type"])
        with urllib.request.urlopen(url + "status", timeout=20) as status:
            self.assertEqual(json.load(status)["keyframes"], self.summary()["keyframes"])
        self.process.send_signal(signal.SIGINT)
        self.end()

    def test_frames_that_come_too_early_are_dropped_and_counted(self):
        done = self.run_on(self.sequence("stereo"), "--timing", "realtime", "--pace", "40")
        self.assertEqual(done.returncode, 0, done.stderr)
        summary, rows = self.summary(), self.frames()
        dropped = [row for row in rows if row["state"] == "dropped"]
        self.assertEqual(len(rows), summary["frames"])
        self.assertEqual(len(dropped), summary["dropped"])
        self.assertGreater(len(dropped), 0)
        self.assertEqual({row["reason"] for row in dropped}, {"late"})
        self.assertEqual(summary["timing"], "realtime")


class Hostile(ViewerTest):
    """The session goes on undisturbed, bit for bit."""

    def attack(self, url):
        parts = urllib.parse.urlsplit(url)
        address = (parts.hostname, parts.port)
        rng = random.Random(1)
        held = []
        for size in (1, 100, 20000):  # random bytes
            garbage = socket.create_connection(address, 10)
            garbage.sendall(rng.randbytes(size))
            held.append(garbage)
        for _ in range(200):  # connections that say nothing
            held.append(socket.create_connection(address, 10))
        for connection in held:
            connection.close()
        for origin in ("http://evil.example", "null"):
            with self.assertRaisesRegex(Refused, "403"):
                ViewerClient(url, origin=origin)
        huge = self.connect(url)
        try:
            huge.send_frame(1, b"x" * 10_000_000)
            for _ in range(1000):
                huge.receive()
            self.fail("a message of 10 MB was accepted")
        except (ConnectionError, OSError):
            pass
        slow = self.connect(url)  # never reads
        flood = self.connect(url)
        try:
            for _ in range(20000):
                flood.request("landmark", id=1)
        except (ConnectionError, OSError):
            pass
        invalid = self.connect(url)
        invalid.send_frame(1, b"\xff\xfe")  # not UTF-8, which text has to be
        with self.assertRaises(ConnectionError):
            invalid.wait_for(lambda c: False)
        for text in (b"[" * 60000, b"{}", b"null", b'{"request": 1, "do": "mapping", "on": 7}'):
            polite = self.connect(url)
            polite.send_frame(1, text)
            polite.wait_for(lambda c: any(t["type"] == "reply" and not t["ok"] for t in c.texts))
            polite.close()
        return [slow, huge, flood]

    def test_nobody_on_the_port_does_harm(self):
        url = self.run_with_viewer(pace=0.1)
        held = self.attack(url)
        client = self.connect(url)
        client.wait_for(lambda c: c.holds_what_status_says())
        self.end()
        client.close()
        for connection in held:
            connection.close()
        attacked = (self.out / "trajectory.txt").read_bytes()
        self.assertEqual(self.run_on(self.folder / "input_stereo").returncode, 0)
        self.assertEqual((self.out / "trajectory.txt").read_bytes(), attacked)

    def test_another_address_needs_the_token(self):
        url = self.run_with_viewer(address="0.0.0.0:0", pace=0.1)
        port, token = re.search(r":(\d+)/\?token=([0-9a-f]{32})$", url).groups()
        here = f"http://127.0.0.1:{port}/"
        for wrong in ("", "?token=", f"?token={token[:-1]}", f"?token={'0' * 32}"):
            with self.assertRaisesRegex(Refused, "403"):
                ViewerClient(here + wrong)
        with self.assertRaises(urllib.error.HTTPError):
            urllib.request.urlopen(here + "status", timeout=20)
        client = self.connect(f"{here}?token={token}")
        client.wait_for(lambda c: c.is_complete and c.status["tracked"] > 0)
        client.ask("stop")
        self.end()


if __name__ == "__main__":
    unittest.main()
