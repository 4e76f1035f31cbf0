#!/usr/bin/python3
# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""System: fed from arrays it gives what the program gives; what is wrong is said in one line."""
import subprocess
import sys
import threading
import unittest

import numpy as np
import waymark
from support import DATA, Test, camchain, frames, map_stereo


class AsTheProgram(Test):
    """Every pose, to the last printed digit."""

    def check(self, setup, system):
        written = self.folder / "trajectory.txt"
        trajectory = system.trajectory()
        trajectory.largest().write(written)
        self.assertEqual(written.read_bytes(), (DATA / f"{setup}_out/trajectory.txt").read_bytes())
        times = np.loadtxt(written)[:, 0]
        np.testing.assert_allclose(1e-9 * trajectory.largest().timestamps_ns, times, atol=1e-9)
        positions = trajectory.largest().world_from_rig[:, :3, 3]
        np.testing.assert_allclose(positions, np.loadtxt(written)[:, 1:4], atol=1e-7)

    def test_stereo(self):
        self.check("stereo", map_stereo())

    def test_mono(self):
        with waymark.System(str(camchain()), setup="mono", timing="inline") as system:
            for frame in frames():
                system.feed(frame.timestamp_ns, frame.image0)
        self.check("mono", system)

    def test_rgbd(self):
        with waymark.System(camchain("rgbd")) as system:
            for frame in frames("rgbd"):
                system.feed(frame.timestamp_ns, frame.image0, depth=frame.depth)
        self.check("rgbd", system)

    def test_depth_in_metres(self):
        factor = waymark.Calibration(camchain("rgbd")).depth_factor
        with waymark.System(camchain("rgbd"), setup="rgbd") as system:
            for frame in frames("rgbd"):
                depth_m = (frame.depth / factor).astype(np.float32)
                depth_m[frame.depth == 0] = np.nan
                system.feed(frame.timestamp_ns, frame.image0, depth=depth_m)
        self.check("rgbd", system)

    def test_config_of_parts(self):
        """A dict with numpy values, settings over it, colour and arrays that are not contiguous."""
        chain = {f"cam{i}": {"camera_model": camera.model, "intrinsics": np.array(camera.intrinsics),
                             "distortion_model": camera.distortion_model,
                             "distortion_coeffs": camera.distortion_coeffs,
                             "resolution": (camera.width_px, camera.height_px)}
                 for i, camera in enumerate(waymark.Calibration(camchain()).cameras)}
        chain["cam1"]["T_cn_cnm1"] = waymark.Calibration(camchain()).cameras[1].cam_from_rig
        chain["features"] = {"count": 200}
        with waymark.System([chain], settings={"features.count": np.int64(1000)}, seed=0) as system:
            for frame in frames():
                color = np.repeat(frame.image0[:, :, None], 3, axis=2)
                reverse = np.ascontiguousarray(frame.image1[:, ::-1])[:, ::-1]
                self.assertFalse(reverse.flags.c_contiguous)
                wide = np.zeros((frame.image0.shape[0], 500), np.uint8)
                wide[:, :frame.image0.shape[1]] = frame.image0
                image0 = color if frame.index % 2 else wide[:, :frame.image0.shape[1]]
                system.feed(np.int64(frame.timestamp_ns), image0, reverse)
        self.check("stereo", system)


class Results(Test):
    def test_result_of_a_frame(self):
        system = waymark.System(camchain())
        first = frames()[0]
        result = system.feed(first.timestamp_ns, first.image0, first.image1)
        self.assertEqual((result.frame, result.state, result.reason), (0, "tracked", "none"))
        np.testing.assert_allclose(result.world_from_rig, np.eye(4), atol=1e-6)
        self.assertEqual(result.covariance.shape, (6, 6))
        self.assertEqual(result.submap, 0)
        self.assertIn("features", result.stages_ms)
        self.assertGreater(result.tracking_ms, 0)
        second = frames()[1]
        self.assertEqual(system.feed(second.timestamp_ns, second.image0, second.image1).frame, 1)
        features = system.details().features
        self.assertEqual(features.pixels.shape, (len(features), 2))
        self.assertEqual(features.landmarks.shape, (len(features),))
        self.assertIn("tracked", repr(result))

    def test_frame_without_anything_to_see(self):
        system = waymark.System(camchain(), setup="mono")
        result = system.feed(0, np.zeros((240, 376), np.uint8))
        self.assertIsNone(result.world_from_rig)
        self.assertEqual((result.state, result.reason), ("initializing", "no_features"))
        self.assertIsNone(result.submap)
        system.finish()
        trajectory = system.trajectory()
        self.assertEqual((len(trajectory), len(trajectory.largest())), (0, 0))
        self.assertEqual(trajectory.world_from_rig.shape, (0, 4, 4))
        self.assertEqual(trajectory.timestamps_ns.dtype, np.int64)

    def test_mask_leaves_out_features(self):
        frame = frames()[0]
        mask = np.ones(frame.image0.shape, bool)
        mask[:, 188:] = False
        for given in (mask, mask.astype(np.uint8), np.asfortranarray(mask)):
            system = waymark.System(camchain())
            system.feed(frame.timestamp_ns, frame.image0, frame.image1, mask=given)
            features = system.details().features
            self.assertGreater(features.num_primary, 50)
            self.assertLess(features.pixels[:features.num_primary, 0].max(), 189)

    def test_what_moves_along(self):
        way = frames("turned")
        system = waymark.System(camchain("turned"), settings={"features.count": 300})
        rows, columns = np.mgrid[:40, :150]
        for i in range(110):
            frame = way[min(i % 38, 38 - i % 38)]
            image0 = frame.image0.copy()
            image0[-40:, 100:250] = 100 + (columns // 10 + rows // 10) % 2 * 40
            system.feed(50_000_000 * i, image0, frame.image1)
        mask = system.ego_mask()
        self.assertEqual((mask.dtype, mask.shape), (np.uint8, way[0].image0.shape))
        self.assertLess(mask[-30:, 110:240].mean(), 60)
        self.assertGreater(mask[:-60].mean(), 250)

    def test_totals_while_it_runs(self):
        system = waymark.System(camchain(), timing="inline")
        self.assertEqual(system.statistics().num_keyframes, 0)
        for frame in frames()[:20]:
            system.feed(frame.timestamp_ns, frame.image0, frame.image1)
            statistics = system.statistics()
            self.assertEqual(statistics.num_keyframes, system.map().num_keyframes)
            self.assertEqual(statistics.num_landmarks, system.map().num_landmarks)
        self.assertGreaterEqual(statistics.num_keyframes, 2)
        self.assertGreaterEqual(len(statistics.mapping_ms), statistics.num_keyframes)

    def test_finished_session(self):
        system = map_stereo()
        self.assertTrue(system.is_finished)
        system.finish()
        statistics = system.statistics()
        self.assertEqual(statistics.num_keyframes, system.map().num_keyframes)
        self.assertEqual(len(statistics.mapping_ms), statistics.num_keyframes)
        self.assertEqual(set(system.frame_states()), {"tracked"})
        trajectory = system.trajectory()
        self.assertEqual(trajectory.frames.tolist(), list(range(len(frames()))))
        self.assertFalse(trajectory.is_filled.any())
        self.assertFalse(trajectory.world_from_rig.flags.writeable)
        self.assertIsNone(system.ego_mask())
        self.assertEqual(system.calibration(), [])

    def test_calibration_that_images_contradict(self):
        with waymark.System(camchain("turned"), settings={"features.count": 300}) as system:
            for frame in frames("turned"):
                system.feed(frame.timestamp_ns, frame.image0, frame.image1)
        estimates = {estimate.name: estimate for estimate in system.calibration()}
        turn = estimates["cam1.turn_y"]
        self.assertTrue(turn.is_changed)
        self.assertEqual(turn.given, 0)
        self.assertLess(abs(abs(turn.change) - 2e-3), 3e-4)
        self.assertTrue(0 < turn.sigma < turn.given_sigma)
        self.assertFalse(estimates["cam0.fu"].is_changed)

    def test_map_is_the_same_object_until_it_changes(self):
        system = waymark.System(camchain(), timing="inline")
        for frame in frames()[:10]:
            system.feed(frame.timestamp_ns, frame.image0, frame.image1)
        before = system.map()
        self.assertIs(system.map(), before)
        num_before = before.num_keyframes
        system.finish()
        self.assertIsNot(system.map(), before)
        self.assertEqual(before.num_keyframes, num_before)

    def test_reset_and_mapping_off(self):
        system = waymark.System(camchain(), timing="inline")
        some = frames()
        for frame in some[:20]:
            system.feed(frame.timestamp_ns, frame.image0, frame.image1)
        system.set_mapping(False)
        num_keyframes = system.map().num_keyframes
        for frame in some[20:30]:
            self.assertFalse(system.feed(frame.timestamp_ns, frame.image0, frame.image1).is_keyframe)
        self.assertLessEqual(system.map().num_keyframes, num_keyframes + 2)
        system.reset()
        self.assertEqual(system.map().num_keyframes, 0)
        system.set_mapping(True)
        self.assertEqual(system.feed(0, some[0].image0, some[0].image1).frame, 0)

    def test_inertial_samples_by_themselves_and_in_arrays(self):
        reports = []
        for is_array in (False, True):
            system = waymark.System(camchain(), timing="inline")
            self.assertIsNone(system.inertial())
            for frame in frames():
                times = frame.timestamp_ns + np.arange(10) * 5_000_000
                turns, pushes = np.zeros((10, 3)), np.tile((0.0, -9.81, 0.0), (10, 1))
                if is_array:
                    system.feed_imu(times, turns, pushes)
                else:
                    for time, turn, push in zip(times, turns, pushes.tolist()):
                        system.feed_imu(int(time), turn, push)
                system.feed(frame.timestamp_ns, frame.image0, frame.image1)
            system.finish()
            reports.append(system.inertial())
            self.assertEqual(system.inertial_path(), [])
        # The camera does turn, and this says that it does not.
        self.assertFalse(reports[0].is_used)
        self.assertNotEqual(reports[0].reason, "")
        self.assertEqual(repr(reports[0]), repr(reports[1]))
        self.assert_raises(RuntimeError, "after finish", system.feed_imu, 0, turns[0], pushes[0])

    def test_inertial_samples_of_wrong_shapes(self):
        system = waymark.System(camchain())
        self.assert_raises(ValueError, "expected one for each of 2 times", system.feed_imu, [0, 1], np.zeros((2, 3)),
                           np.zeros(3))
        self.assert_raises(TypeError, "timestamp_ns", system.feed_imu, 0.5, np.zeros(3), np.zeros(3))
        self.assert_raises(ValueError, "angular_velocity", system.feed_imu, 0, np.zeros(4), np.zeros(3))

    def test_a_map_in_a_file_gives_the_same(self):
        def positions(limit_gb):
            system = waymark.System(camchain())
            if limit_gb is not None:
                system.keep_map_in(self.folder, max_memory_gb=limit_gb)
            for frame in frames()[:20]:
                system.feed(frame.timestamp_ns, frame.image0, frame.image1)
            self.assert_raises(RuntimeError, "expected before", system.keep_map_in, self.folder, max_memory_gb=1)
            system.finish()
            return system.map().landmarks().positions_in_world

        np.testing.assert_array_equal(positions(0), positions(None))
        self.assertEqual(list(self.folder.iterdir()), [])

    def test_a_map_in_no_file(self):
        system = waymark.System(camchain())
        self.assert_raises(waymark.OutputError, "missing", system.keep_map_in, self.folder / "missing", max_memory_gb=1)
        self.assert_raises(ValueError, "max_memory_gb", system.keep_map_in, self.folder, max_memory_gb=-1)
        self.assert_raises(ValueError, "max_memory_gb", system.keep_map_in, self.folder, max_memory_gb=float("nan"))
        self.assert_raises(TypeError, "max_memory_gb", system.keep_map_in, self.folder, max_memory_gb="much")
        self.assert_raises(TypeError, "folder", system.keep_map_in, 3, max_memory_gb=1)

    def test_goes_on_in_a_map(self):
        saved = waymark.Map.load(DATA / "stereo_out/map.wmap")
        system = waymark.System(camchain(), map=saved)
        frame = frames()[20]
        result = system.feed(10**15, frame.image0, frame.image1)
        self.assertEqual(result.state, "tracked")
        system.finish()
        self.assertGreater(system.map().num_keyframes, 0)
        self.assertEqual(saved.num_keyframes, waymark.Map.load(DATA / "stereo_out/map.wmap").num_keyframes)


    def test_settings_beside_a_calibration(self):
        calibration = waymark.Calibration(camchain("rgbd"))
        system = waymark.System(calibration, settings={"depth.factor": 2500, "features": {"count": 700}})
        self.assertIn("factor: 2500", system.map().settings)
        self.assertIn("count: 700", system.map().settings)
        self.assert_raises(waymark.InputError, "depth.factor", waymark.System, calibration,
                           settings={"depth": {"factor": 0}})

    def test_left_unfinished(self):
        """A program may end without finish()."""
        program = ("import waymark; frames = list(waymark.open_input(%r)); system = waymark.System(%r)\n"
                   "for f in frames[:8]: system.feed(f.timestamp_ns, f.image0, f.image1)"
                   % (str(DATA / "stereo"), str(camchain())))
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_left_in_a_process_that_is_forked(self):
        """It has none of the threads of the object, and does not wait for them."""
        program = ("import os, waymark; frames = list(waymark.open_input(%r)); system = waymark.System(%r)\n"
                   "viewer = system.view('127.0.0.1:0')\n"
                   "def feed(): system.feed(frames[0].timestamp_ns, frames[0].image0, frames[0].image1)\n"
                   "child = os.fork()\n"
                   "if child == 0:\n"
                   "    try: feed()\n"
                   "    except RuntimeError: del viewer, system, feed; os._exit(7)\n"
                   "assert os.waitstatus_to_exitcode(os.waitpid(child, 0)[1]) == 7\n"
                   "feed(); system.finish()" % (str(DATA / "stereo"), str(camchain())))
        done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
        self.assertEqual((done.returncode, done.stderr), (0, ""))

    def test_left_by_a_daemon_thread(self):
        """The interpreter ends while a thread is in feed(), and does not wait for it."""
        program = ("import threading, waymark; frames = list(waymark.open_input(%r))\n"
                   "system, has_begun = waymark.System(%r, timing='inline'), threading.Event()\n"
                   "def feed():\n"
                   "    for frame in frames:\n"
                   "        system.feed(frame.timestamp_ns, frame.image0, frame.image1)\n"
                   "        has_begun.set()\n"
                   "threading.Thread(target=feed, daemon=True).start(); has_begun.wait()"
                   % (str(DATA / "stereo"), str(camchain())))
        for _ in range(3):
            done = subprocess.run([sys.executable, "-c", program], capture_output=True, text=True, timeout=60)
            self.assertEqual((done.returncode, done.stderr), (0, ""))


class WrongArguments(Test):
    def setUp(self):
        super().setUp()
        self.system = waymark.System(camchain())
        self.frame = frames()[0]
        self.left, self.right = self.frame.image0, self.frame.image1

    def refuses(self, error, words, *arguments, **options):
        self.assert_raises(error, words, self.system.feed, *arguments, **options)

    def test_types(self):
        for wrong, words in ((None, "is None"), ("image.png", "of type str"), ([[1, 2]], "of type list"),
                             (self.left.astype(np.float32), "array of float32"),
                             (self.left.astype(np.int8), "array of int8"),
                             (self.left.astype(object), "array of object")):
            self.refuses(TypeError, ["image0: ", words, "uint8"], 0, wrong, self.right)
        self.refuses(TypeError, "mask: ", 0, self.left, self.right, mask=self.left.astype(float))
        self.refuses(TypeError, "timestamp_ns: ", 0.5, self.left, self.right)
        self.refuses(TypeError, "timestamp_ns: ", None, self.left, self.right)
        self.refuses(ValueError, "64 bits", 2**64, self.left, self.right)

    def test_shapes(self):
        for wrong in (self.left[0], self.left[None], np.zeros((0, 0), np.uint8), np.array(3, np.uint8),
                      np.zeros((240, 376, 4), np.uint8), np.zeros((240, 0, 3), np.uint8),
                      np.zeros((1, 100000), np.uint8)):
            self.refuses(ValueError, ["image0: ", str(wrong.shape)], 0, wrong, self.right)
        self.refuses(waymark.InputError, ["375 x 240", "376 x 240"], 0, self.left[:, 1:], self.right)
        self.refuses(waymark.InputError, "mask", 0, self.left, self.right, mask=self.left[:9])

    def test_images_that_the_setup_has_not(self):
        self.refuses(ValueError, "image1: is None", 0, self.left)
        self.refuses(ValueError, "setup stereo", 0, self.left, self.right, depth=self.left)
        self.system = waymark.System(camchain(), setup="mono")
        self.refuses(ValueError, "setup mono", 0, self.left, self.right)
        self.system = waymark.System(camchain("rgbd"), setup="rgbd")
        self.refuses(ValueError, "depth: is None", 0, self.left)
        self.system = waymark.System(camchain("rgbd"))
        self.refuses(TypeError, "depth: ", 0, self.left, depth=np.zeros((240, 376)))
        self.refuses(ValueError, "depth: ", 0, self.left, depth=np.zeros((240, 376, 1), np.float32))
        self.refuses(waymark.InputError, "depth", 0, self.left, depth=np.zeros((240, 3), np.uint16))
        self.system.feed(0, self.left)
        self.refuses(ValueError, "setup mono", 1, self.left, depth=np.zeros((240, 376), np.uint16))

    def test_time_and_state(self):
        self.system.feed(5, self.left, self.right)
        self.refuses(waymark.InputError, "time stamp", 5, self.left, self.right)
        self.system.finish()
        self.refuses(RuntimeError, "after finish", 6, self.left, self.right)
        self.assert_raises(RuntimeError, "after finish", self.system.reset)
        self.assert_raises(RuntimeError, "after finish", self.system.set_mapping, True)
        self.assert_raises(waymark.OutputError, "no/such", self.system.save, self.folder / "no/such")
        self.assert_raises(ValueError, "format", self.system.trajectory().write, "x", "csv")
        self.assert_raises(TypeError, "path", self.system.trajectory().write, 3)

    def test_an_exception_in_the_block_does_not_finish(self):
        with self.assertRaises(ZeroDivisionError):
            with self.system:
                raise ZeroDivisionError
        self.assertFalse(self.system.is_finished)

    def test_constructor(self):
        make = waymark.System
        endless, deep = [], 1
        endless.append(endless)
        for _ in range(100000):
            deep = [deep]
        for cameras in (endless, deep, [[[deep]], endless], ((endless,),)):
            self.assert_raises(waymark.InputError, ["cameras: ", "nested"], make, cameras)
        self.assert_raises(waymark.InputError, ["cameras: ", "recursion"], make, {"cam0": deep})
        self.assert_raises(TypeError, "cameras: ", make, None)
        self.assert_raises(TypeError, "cameras: ", make, 3)
        self.assert_raises(waymark.InputError, "no camera", make, {})
        self.assert_raises(waymark.InputError, "no camera", make, [])
        self.assert_raises(waymark.InputError, "camera_modl", make, {"cam0": {"camera_modl": "pinhole"}})
        self.assert_raises(waymark.InputError, "no/such.yaml", make, "no/such.yaml")
        for options, error, words in (
                ({"setup": "both"}, ValueError, "'both'"), ({"setup": 1}, TypeError, "setup"),
                ({"timing": "fast"}, ValueError, "'fast'"),
                ({"settings": {"features.cuont": 1}}, waymark.InputError, "features.count"),
                ({"settings": {"features": {"count": -1}}}, waymark.InputError, "-1"),
                ({"settings": {"": 1}}, waymark.InputError, "key"),
                ({"settings": {3: 1}}, TypeError, "names"), ({"settings": "x"}, TypeError, "dict"),
                ({"settings": {"features.count": float("nan")}}, waymark.InputError, "NaN"),
                ({"settings": {"features.count": object()}}, TypeError, "YAML"),
                ({"settings": {"features.count": endless}}, waymark.InputError, ["settings: ", "Circular"]),
                ({"settings": {"features": deep}}, waymark.InputError, ["settings: ", "recursion"]),
                ({"settings": {"\udcff": 1}}, ValueError, "whole characters"),
                ({"setup": "mono\0x"}, ValueError, "'mono?x'"), ({"setup": "\udcff"}, ValueError, "setup"),
                ({"timing": "inline\0"}, ValueError, "'inline?'"),
                ({"seed": -1}, waymark.InputError, "seed"), ({"seed": 0.5}, TypeError, "seed")):
            self.assert_raises(error, words, make, camchain(), **options)
        self.assert_raises(waymark.InputError, "one camera", make, camchain("rgbd"), setup="stereo")
        with self.assertRaises(TypeError):
            make(camchain(), map="map.wmap")
        self.assertTrue(issubclass(waymark.InputError, ValueError))
        self.assertTrue(issubclass(waymark.OutputError, OSError))


class Threads(Test):
    def test_numpy_is_there_before_any_thread(self):
        """Two threads that made the first arrays at once waited for each other, one to import numpy
        and one, which kept the interpreter, for it to be imported."""
        program = "import sys, waymark; sys.exit('numpy.core.multiarray' not in sys.modules)"
        self.assertEqual(subprocess.run([sys.executable, "-c", program], timeout=60).returncode, 0)

    def test_fed_from_another_thread(self):
        system, some, failures = waymark.System(camchain()), frames(), []

        def feed():
            try:
                for frame in some:
                    system.feed(frame.timestamp_ns, frame.image0, frame.image1)
            except Exception as failure:
                failures.append(failure)

        thread = threading.Thread(target=feed)
        thread.start()
        num_turns = 0  # Of this thread while the other one is in feed().
        while thread.is_alive():
            num_turns += 1
        thread.join()
        self.assertEqual(failures, [])
        self.assertGreater(num_turns, len(some))
        system.finish()
        self.assertEqual(len(system.trajectory()), len(some))

    def test_two_threads_at_once(self):
        """Each call either works or says that the other thread is in there."""
        system, some, outcomes = waymark.System(camchain()), frames(), []

        def read():
            while not is_done:
                try:
                    outcomes.append(len(system.trajectory()))
                except RuntimeError as busy:
                    outcomes.append(str(busy))

        is_done = False
        reader = threading.Thread(target=read)
        reader.start()
        num_fed = 0
        for frame in some:
            try:
                system.feed(frame.timestamp_ns, frame.image0, frame.image1)
                num_fed += 1
            except RuntimeError as busy:
                self.assertIn("another thread", str(busy))
        is_done = True
        reader.join()
        messages = {outcome for outcome in outcomes if isinstance(outcome, str)}
        self.assertEqual(len(messages), 1)
        self.assertIn("another thread", messages.pop())
        self.assertEqual(len(system.frame_states()), num_fed)


if __name__ == "__main__":
    unittest.main()
