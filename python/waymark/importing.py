# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Maps and settings of OpenVSLAM and stella_vslam, and settings of ORB-SLAM: `waymark import`, docs/exchange.md.

A map becomes one as if it had been made here: keyframes with features, descriptors and poses, landmarks with observations, the
spanning tree and loop edges. What such a file does not hold is computed by the engine, in C++."""
import contextlib
import heapq
import math
import os
import pathlib
import sys

import numpy as np

from waymark import _waymark
from waymark.importing_cameras import calibration, fail, printable, quoted

ROTATION_TOLERANCE = 0.02  # How far from a rotation a quaternion may be.
MAX_PIXELS = 2e11  # Of all keyframes together, whose search grids take memory: 100 000 images of 2 megapixels.
SCALE_FACTOR, NUM_LEVELS = 1.2, 8  # Of our pyramid.
NO_ID = _waymark.NO_ID


class Camera:
    """What keyframes of a camera of the file were seen by."""

    def __init__(self, camera, builder):
        chain = calibration(camera.cameras())
        self.setup, self.cameras, self.builder = camera.setup, chain.cameras, builder
        self.rig = builder.add_rig(chain)
        self.num_pixels = self.cameras[0].width_px * self.cameras[0].height_px

    def see(self, index, pixels):
        """(pixels in the images of a camera of the rig, whether it sees them) of key points without distortion; of an
        equirectangular camera they are pixels of its own."""
        camera, pixels = self.cameras[index], pixels.astype(float)
        if camera.intrinsics:
            focal, centre = np.reshape(self.cameras[0].intrinsics, (2, 2))
            pixels, is_seen = camera.project(np.column_stack([(pixels - centre) / focal, np.ones(len(pixels))]))
        else:
            is_seen = ((pixels >= -0.5) & (pixels < np.array([camera.width_px, camera.height_px]) - 0.5)).all(axis=1)
        pixels, is_seen = pixels.astype(np.float32), is_seen.copy()
        is_seen[is_seen] = self.builder.have_bearings(self.rig, index, pixels[is_seen])
        return pixels, is_seen


class Importer:
    def __init__(self, records, name):
        self.records, self.name, self.notes = records, name, []
        self.builder = _waymark._MapBuilder()
        self.ids, self.features, self.submaps = {}, {}, {}  # By id of the file; sub-maps by our id.

    def note(self, count, what):
        if count > 0:
            self.notes.append(f"{self.name}: {count} {what}")

    def build(self):
        if not self.records.keyframes:
            fail(self.name, "has no keyframes, expected a map")
        self.cameras = {name: Camera(camera, self.builder) for name, camera in self.records.cameras.items()}
        self.add_keyframes()
        self.add_landmarks(*self.observations())
        self.add_loop_edges()
        return self.builder.finish()

    def camera_of(self, keyframe):
        return self.cameras.get(keyframe.camera) or fail(keyframe.where, f"cam is {quoted(keyframe.camera)}, expected one of cameras")

    def add_keyframes(self):
        """In the order of their ids as far as parents come before their children."""
        children, ready, num_pixels = {}, [], 0
        for number, keyframe in sorted(self.records.keyframes.items()):
            num_pixels += self.camera_of(keyframe).num_pixels
            if keyframe.parent < 0:
                ready.append(number)
            elif keyframe.parent in self.records.keyframes:
                children.setdefault(keyframe.parent, []).append(number)
            else:
                fail(keyframe.where, f"span_parent is {keyframe.parent}, expected a keyframe")
        if num_pixels > MAX_PIXELS:
            fail(self.name, f"has {num_pixels:.3g} pixels in {len(self.records.keyframes)} keyframes, expected at most {MAX_PIXELS:.3g}")
        while ready:
            number = heapq.heappop(ready)
            self.add_keyframe(number, self.records.keyframes[number])
            for child in children.get(number, ()):
                heapq.heappush(ready, child)
        for number, keyframe in sorted(self.records.keyframes.items()):
            if number not in self.ids:
                fail(keyframe.where, "span_parent leads round in a circle, expected a tree")

    def levels_of(self, keyframe):
        """The levels of our pyramid at which pixels have the size nearest to those of theirs."""
        scale, num_levels = keyframe.pyramid if isinstance(keyframe.pyramid, tuple) else (
            self.records.pyramids.get(keyframe.pyramid) or
            fail(keyframe.where, f"orb_params is {quoted(keyframe.pyramid)}, expected one of orb_params"))
        if (keyframe.levels >= num_levels).any():
            at = np.argmax(keyframe.levels >= num_levels)
            fail(keyframe.where, f"undist_keypts[{at}].oct is {keyframe.levels[at]}, expected a level below {num_levels}")
        nearest = [min(math.floor(level * math.log(scale) / math.log(SCALE_FACTOR) + 0.5), NUM_LEVELS - 1) for level in range(num_levels)]
        return np.array(nearest)[keyframe.levels.astype(int)]

    def features_of(self, keyframe, camera):
        """What the builder takes, and which of the key points these are. The pair of a stereo camera is rectified: what camera 1
        sees is in the same row."""
        pixels, is_seen = camera.see(0, keyframe.pixels)
        radians = np.radians(keyframe.angles_deg)
        features = {"pixels": pixels[is_seen], "angles_rad": (radians - 2 * np.pi * np.rint(radians / (2 * np.pi)))[is_seen],
                    "levels": self.levels_of(keyframe)[is_seen], "descriptors": keyframe.descriptors[is_seen],
                    "owners": (), "pixels1": np.zeros((0, 2)), "depths_m": ()}
        if camera.setup == "stereo" and len(keyframe.right_columns):
            columns = keyframe.right_columns[is_seen]
            right, is_pair = camera.see(1, np.column_stack([columns, keyframe.pixels[is_seen, 1]]))
            is_pair &= columns >= 0
            features.update(owners=np.flatnonzero(is_pair).tolist(), pixels1=right[is_pair])
        if camera.setup == "rgbd" and len(keyframe.depths_m):
            features["depths_m"] = keyframe.depths_m[is_seen]
        return features, is_seen

    def add_keyframe(self, number, keyframe):
        norm = math.hypot(*keyframe.rotation)
        if not abs(norm - 1) <= ROTATION_TOLERANCE:
            fail(keyframe.where, f"rot_cw is a quaternion of length {norm:.4g}, expected 1")
        camera = self.camera_of(keyframe)
        features, is_seen = self.features_of(keyframe, camera)
        parent = self.ids[keyframe.parent] if keyframe.parent >= 0 else NO_ID
        submap = self.submaps[parent] if keyframe.parent >= 0 else self.builder.add_submap(camera.setup != "monocular")
        added = self.builder.add_keyframe(camera.rig, submap, parent, math.floor(keyframe.time_s * 1e9 + 0.5),
                                          [*keyframe.rotation, *keyframe.translation], features)
        self.ids[number], self.submaps[added] = added, submap
        self.features[number] = np.where(is_seen, np.cumsum(is_seen) - 1, -1)

    def observations(self):
        """(their ids in the file, rows of index there, keyframe, feature), rows ascending."""
        known = np.array(sorted(self.records.landmarks), np.int64)
        num_points = num_dropped = num_dangling = num_again = 0
        rows = [np.zeros((0, 3), np.int64)]
        for number, keyframe in sorted(self.records.keyframes.items()):
            features = self.features[number]
            num_points += len(features)
            num_dropped += np.count_nonzero(features < 0)
            is_used = (features >= 0) & (keyframe.landmarks >= 0)
            landmarks = keyframe.landmarks[is_used]
            is_known = np.isin(landmarks, known)
            num_dangling += np.count_nonzero(~is_known)
            at, first = np.unique(np.searchsorted(known, landmarks[is_known]), return_index=True)
            num_again += np.count_nonzero(is_known) - len(at)
            rows.append(np.column_stack([at, np.full(len(at), self.ids[number]), features[is_used][is_known][first]]))
        self.note(num_dropped, "key points that the camera cannot have seen are left out")
        self.note(num_dangling, "observations of landmarks that are not in the file are left out")
        self.note(num_again, "observations of landmarks that the keyframe sees already are left out")
        if 2 * num_dropped > num_points > 0:
            fail(self.name, f"{num_dropped} of {num_points} key points are outside the images, expected a camera that fits them")
        rows = np.concatenate(rows)
        return known, rows[np.lexsort(rows.T[::-1])]

    def add_landmarks(self, known, rows):
        num_unseen = num_inside = num_elsewhere = 0
        ends = np.searchsorted(rows[:, 0], np.arange(len(known) + 1))
        for i, number in enumerate(known.tolist()):
            seen = [tuple(row) for row in rows[ends[i]:ends[i + 1], 1:].tolist()]
            if not seen:
                num_unseen += 1
                continue
            observations = [row for row in seen if self.submaps[row[0]] == self.submaps[seen[0][0]]]
            num_elsewhere += len(seen) - len(observations)
            landmark = self.records.landmarks[number]
            reference = self.ids.get(landmark.reference)
            if reference not in [keyframe for keyframe, _ in observations]:
                reference = observations[0][0]
            counts = (max(landmark.num_visible, landmark.num_found), landmark.num_found)
            num_inside += not self.builder.add_landmark(landmark.position, reference, observations, counts)
        self.note(num_unseen, "landmarks that no keyframe sees are left out")
        self.note(num_inside, "landmarks inside a camera that sees them are left out")
        self.note(num_elsewhere, "observations across sub-maps are left out")

    def add_loop_edges(self):
        added, num_dangling = set(), 0
        for number, keyframe in sorted(self.records.keyframes.items()):
            start = self.ids[number]
            for other in map(int, keyframe.loop_edges):
                end = self.ids.get(other, start)
                if end == start or self.submaps[start] != self.submaps[end]:
                    num_dangling += 1
                elif (min(start, end), max(start, end)) not in added:
                    added.add((min(start, end), max(start, end)))
                    self.builder.add_loop_edge(start, end)
        self.note(num_dangling, "loop edges that lead nowhere are left out")


def take_over(path, settings=None):
    """(Map, notes, cameras that it was seen by). settings: of the program that made it."""
    from waymark import importing_database, importing_messagepack, importing_settings
    path, name = os.fspath(path), printable(os.fspath(path))
    pyramid = importing_settings.pyramid(settings) if settings else (1.2, 8)
    _waymark._expect_file(path, "a map (.msg or .db)")
    has_pyramid = not importing_database.is_database(path)
    records = importing_messagepack.read(path, name) if has_pyramid else importing_database.read(path, name, pyramid)
    importer = Importer(records, name)
    result = importer.build()
    if not has_pyramid:
        importer.notes.append(f"{name}: the image pyramid, which it does not store, is {pyramid[1]} levels of {pyramid[0]:g}" +
                              "; --settings FILE may say otherwise" * (settings is None))
    used = {keyframe.camera for keyframe in importer.records.keyframes.values()}
    return result, importer.notes, [importer.cameras[camera].cameras[0] for camera in used]


def import_map(path):
    """Takes over a map (.msg, .db) of OpenVSLAM or stella_vslam: the Map, and a list of str that says what was left out. InputError
    for one that is damaged."""
    return take_over(path)[:2]


def import_settings(path):
    """The Calibration in the settings (YAML) of these programs, or of ORB-SLAM2 and 3. InputError for what is malformed."""
    from waymark import importing_settings
    return importing_settings.read(os.fspath(path), _waymark._config_text(path))


# The command.


def tell(text):
    with contextlib.suppress(OSError):
        sys.stderr.buffer.write(os.fsencode(f"{text}\n"))
        sys.stderr.flush()


def print_result(text):
    try:
        sys.stdout.buffer.write(os.fsencode(text))
        sys.stdout.flush()
    except OSError as error:
        raise _waymark.OutputError(f"standard output: cannot be written: {error.strerror}, expected a reader or enough space") from None


def description(camera):
    return (camera.model, camera.width_px, camera.height_px, camera.intrinsics, camera.distortion_model, camera.distortion_coeffs)


def read_settings(path, text):
    from waymark import importing_settings
    chain = importing_settings.read(path, text)
    for note in chain.notes:
        tell(f"note: {note}")
    return importing_settings.Settings(path, text), chain


def run(source, settings_path, out, from_input):
    settings = chain = None
    if not source and not settings_path:
        fail("command line", "MAP is missing, expected a .msg or .db file, or --settings")
    if pathlib.Path(source).suffix in (".yaml", ".yml"):
        fail(source, f"is a settings file, expected a map (.msg, .db); settings are given as --settings {source}")
    if source and not out:
        fail("command line", "-o is missing, expected the map file to write")
    if settings_path:
        text = sys.stdin.buffer.read() if from_input else _waymark._config_text(settings_path)
        settings, chain = read_settings(settings_path, text)
    if not source:
        camchain = _waymark._camchain(chain)
        return _waymark._write_file(out, camchain) if out else print_result(camchain)
    result, notes, cameras = take_over(source, settings)
    for note in notes:
        tell(f"note: {note}")
    if chain and description(chain.cameras[0]) not in map(description, cameras):
        tell(f"note: {printable(settings_path)}: its camera is none of the map's, which are used")
    result.save(out)
    counts = [f"{count} {what}{'s' * (count != 1)}" for count, what in ((result.num_keyframes, "keyframe"),
                                                                       (result.num_landmarks, "landmark"))]
    return print_result(f"{', '.join(counts)} in {out}\n")


def main(words):
    """words: MAP, settings and file to write, each empty where it is not given, and one more where settings come from the
    standard input. The exit status."""
    try:
        run(*words[:3], from_input=len(words) > 3)
    except _waymark.InputError as error:
        tell(f"error: {error}")
        return 2
    except _waymark.OutputError as error:
        tell(f"error: {error}")
        return 1
    except Exception as error:  # A fault of ours, or no memory.
        tell(f"error: {printable(words[0] or words[1])}: could not finish: {printable(f'{type(error).__name__} {error}')}")
        return 1
    return 0
