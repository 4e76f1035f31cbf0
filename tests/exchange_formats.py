# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Small readers and writers of other programs' formats, written after their documentation alone."""
import math
import random
import sqlite3
import struct


def pack(value):
    """MessagePack, in the longest form of everything."""
    if isinstance(value, bool) or value is None:
        return {None: b"\xc0", False: b"\xc2", True: b"\xc3"}[value]
    if isinstance(value, int):
        return b"\xcf" + struct.pack(">Q", value) if value >= 2**63 else b"\xd3" + struct.pack(">q", value)
    if isinstance(value, float):
        return b"\xcb" + struct.pack(">d", value)
    if isinstance(value, str):
        data = value.encode(errors="surrogateescape")
        return b"\xdb" + struct.pack(">I", len(data)) + data
    if isinstance(value, bytes):
        return b"\xc6" + struct.pack(">I", len(value)) + value
    if isinstance(value, (list, tuple)):
        return b"\xdd" + struct.pack(">I", len(value)) + b"".join(map(pack, value))
    return b"\xdf" + struct.pack(">I", len(value)) + b"".join(
        pack(key) + pack(item) for key, item in value.items())


def rotate(quaternion_wxyz, point):
    """The point turned by a unit quaternion."""
    w, *axis = quaternion_wxyz
    cross = [axis[(i + 1) % 3] * point[(i + 2) % 3] - axis[(i + 2) % 3] * point[(i + 1) % 3]
             for i in range(3)]
    again = [axis[(i + 1) % 3] * cross[(i + 2) % 3] - axis[(i + 2) % 3] * cross[(i + 1) % 3]
             for i in range(3)]
    return [point[i] + 2 * (w * cross[i] + again[i]) for i in range(3)]


def small_msg(num_points=40):
    """A map of stella_vslam: a camera that moves to the right before some points."""
    rng = random.Random(1)
    camera = {"model_type": "Perspective", "setup_type": "Monocular", "color_order": "Gray",
              "cols": 640, "rows": 480, "fps": 30.0, "focal_x_baseline": 0.0, "fx": 400.0,
              "fy": 402.0, "cx": 320.0, "cy": 240.0, "k1": -0.1, "k2": 0.02, "p1": 0.0,
              "p2": 0.0, "k3": 0.0}
    points = [[rng.uniform(-2, 2), rng.uniform(-1, 1), rng.uniform(4, 8)] for _ in range(num_points)]
    keyframes = {}
    for i in range(3):
        seen = [[p[0] - 0.2 * i, p[1], p[2]] for p in points]
        keyframes[str(i)] = {
            "ts": 5.0 + i, "cam": "cam", "orb_params": "orb",
            "rot_cw": [0.0, 0.0, 0.0, 1.0], "trans_cw": [-0.2 * i, 0.0, 0.0],
            "n_keypts": len(points),
            "undist_keypts": [{"pt": [400.0 * p[0] / p[2] + 320.0, 402.0 * p[1] / p[2] + 240.0],
                               "ang": 10.0, "oct": 0} for p in seen],
            "x_rights": [], "depths": [],
            "descs": [[rng.randrange(1 << 32) for _ in range(8)] for _ in points],
            "lm_ids": list(range(len(points))), "span_parent": i - 1, "span_children": [],
            "loop_edges": []}
    landmarks = {str(i): {"1st_keyfrm": 0, "pos_w": p, "ref_keyfrm": 0, "n_vis": 3, "n_fnd": 3}
                 for i, p in enumerate(points)}
    orb = {"name": "orb", "scale_factor": 1.2, "num_levels": 8}
    return {"cameras": {"cam": camera}, "orb_params": {"orb": orb}, "keyframes": keyframes,
            "landmarks": landmarks, "keyframe_next_id": 3, "landmark_next_id": num_points}


def old_keys(document):
    """The same map as OpenVSLAM of 2019 wrote it."""
    del document["orb_params"]
    document["frame_next_id"] = 9
    for keyframe in document["keyframes"].values():
        del keyframe["orb_params"]
        keyframe.update(n_scale_levels=8, scale_factor=1.2, keypts=keyframe["undist_keypts"])
    return document


def other_camera(model, setup, **numbers):
    document = small_msg(4)
    document["cameras"]["cam"].update(model_type=model, setup_type=setup, **numbers)
    if setup != "Monocular":
        for keyframe in document["keyframes"].values():
            keyframe["x_rights"] = [p["pt"][0] - 8.0 for p in keyframe["undist_keypts"]]
            keyframe["depths"] = [5.0, 5.0, -1.0, 5.0]
    return document


def make_database(path, document):
    """The same map in SQLite, as stella_vslam writes it."""
    path.unlink(missing_ok=True)
    base = sqlite3.connect(path)
    numbers = ("cols", "rows", "fx", "fy", "cx", "cy", "k1", "k2", "p1", "p2", "k3", "k4", "focal_x_baseline", "distortion")
    base.execute(f"CREATE TABLE cameras(id INTEGER PRIMARY KEY, name, setup_type, model_type, {', '.join(numbers)})")
    for name, camera in document["cameras"].items():
        base.execute(f"INSERT INTO cameras VALUES(1, ?, ?, ?{', ?' * len(numbers)})",
                     (name, camera["setup_type"], camera["model_type"], *(camera.get(key) for key in numbers)))
    base.execute("CREATE TABLE keyframes(id INTEGER PRIMARY KEY, ts, cam, pose_cw, n_keypts, undist_keypts, x_rights, "
                 "depths, descs)")
    base.execute("CREATE TABLE associations(id INTEGER PRIMARY KEY, lm_ids, span_parent, loop_edges)")
    for number, keyframe in document["keyframes"].items():
        points = keyframe["undist_keypts"]
        blob = b"".join(struct.pack("<5f2i", *p["pt"], 31, p["ang"], 20, p["oct"], -1) for p in points)
        x, y, z, w = keyframe["rot_cw"]
        columns = [(*rotate((w, x, y, z), axis), 0) for axis in ((1, 0, 0), (0, 1, 0), (0, 0, 1))]
        pose = struct.pack("<16d", *sum(columns, ()), *keyframe["trans_cw"], 1)
        base.execute("INSERT INTO keyframes VALUES(?, ?, ?, ?, ?, ?, ?, ?, ?)", (
            int(number), keyframe["ts"], "cam", pose, len(points), blob, b"", b"",
            b"".join(struct.pack("<8I", *words) for words in keyframe["descs"])))
        parent = keyframe["span_parent"]
        base.execute("INSERT INTO associations VALUES(?, ?, ?, ?)", (
            int(number), b"".join(struct.pack("<i", i) for i in keyframe["lm_ids"]), -1 if parent > 2**31 else parent,
            b"".join(struct.pack("<i", i) for i in keyframe.get("loop_edges", []))))
    base.execute("CREATE TABLE landmarks(id INTEGER PRIMARY KEY, pos_w, ref_keyfrm, n_vis, n_fnd)")
    for number, landmark in document["landmarks"].items():
        base.execute("INSERT INTO landmarks VALUES(?, ?, ?, ?, ?)", (
            int(number), struct.pack("<3d", *landmark["pos_w"]), landmark["ref_keyfrm"], landmark["n_vis"], landmark["n_fnd"]))
    base.commit()
    base.close()


def distort(k1, k2, p1, p2, k3, x, y):
    """Brown's lens."""
    r = x * x + y * y
    radial = 1 + r * (k1 + r * (k2 + r * k3))
    return (x * radial + 2 * p1 * x * y + p2 * (r + 2 * x * x),
            y * radial + p1 * (r + 2 * y * y) + 2 * p2 * x * y)


class ColmapModel:
    """A model of perspective cameras in its text or binary form."""

    def __init__(self, folder, suffix):
        self.cameras, self.sizes, self.images, self.points = {}, {}, {}, {}
        if suffix == ".txt":
            self._read_text(folder)
        else:
            self._read_binary(folder)

    @staticmethod
    def _rows(path):
        return [line.split() for line in path.read_text().split("\n")[:-1]
                if not line.startswith("#")]

    def _read_text(self, folder):
        for row in self._rows(folder / "cameras.txt"):
            self.cameras[int(row[0])] = (row[1], list(map(float, row[4:])))
            self.sizes[int(row[0])] = (int(row[2]), int(row[3]))
        rows = self._rows(folder / "images.txt")
        for head, body in zip(rows[::2], rows[1::2]):
            self.images[int(head[0])] = {
                "q": list(map(float, head[1:5])), "t": list(map(float, head[5:8])),
                "camera": int(head[8]), "name": head[9],
                "pixels": [(float(x), float(y), int(i))
                           for x, y, i in zip(body[::3], body[1::3], body[2::3])]}
        for row in self._rows(folder / "points3D.txt"):
            self.points[int(row[0])] = {
                "xyz": list(map(float, row[1:4])), "rgb": list(map(int, row[4:7])),
                "track": [(int(a), int(b)) for a, b in zip(row[8::2], row[9::2])]}

    def _read_binary(self, folder):
        models = {1: ("PINHOLE", 4), 4: ("OPENCV", 8), 5: ("OPENCV_FISHEYE", 8), 6: ("FULL_OPENCV", 12)}
        take = Taker((folder / "cameras.bin").read_bytes())
        for _ in range(take("<Q")):
            number, model = take("<I"), take("<i")
            self.sizes[number] = tuple(take("<QQ"))
            self.cameras[number] = (models[model][0], list(take("<%dd" % models[model][1])))
        take.expect_end()
        take = Taker((folder / "images.bin").read_bytes())
        for _ in range(take("<Q")):
            number = take("<I")
            image = {"q": list(take("<4d")), "t": list(take("<3d")), "camera": take("<I"),
                     "name": take.name()}
            image["pixels"] = [take("<ddq") for _ in range(take("<Q"))]
            self.images[number] = image
        take.expect_end()
        take = Taker((folder / "points3D.bin").read_bytes())
        for _ in range(take("<Q")):
            number = take("<Q")
            point = {"xyz": list(take("<3d")), "rgb": list(take("<3B"))}
            take("<d")
            point["track"] = [take("<II") for _ in range(take("<Q"))]
            self.points[number] = point
        take.expect_end()

    def errors(self):
        """Of all tracks, in pixels."""
        errors = []
        for number, point in self.points.items():
            for image_number, feature in point["track"]:
                image = self.images[image_number]
                u, v, seen = image["pixels"][feature]
                assert seen == number, "a track and its image disagree"
                x, y, z = (a + b for a, b in zip(rotate(image["q"], point["xyz"]), image["t"]))
                _, params = self.cameras[image["camera"]]
                fx, fy, cx, cy, *lens = params
                lens = (lens + [0.0] * 5)[:5]
                x, y = distort(*lens, x / z, y / z)
                errors.append(math.hypot(fx * x + cx - u, fy * y + cy - v))
        return errors


class Taker:
    """Takes values from bytes, one after the other."""

    def __init__(self, data):
        self._data, self._at = data, 0

    def __call__(self, form):
        values = struct.unpack_from(form, self._data, self._at)
        self._at += struct.calcsize(form)
        return values[0] if len(values) == 1 else values

    def name(self):
        end = self._data.index(b"\0", self._at)
        text = self._data[self._at:end].decode()
        self._at = end + 1
        return text

    def expect_end(self):
        assert self._at == len(self._data), "bytes are left over"


def read_ply(path):
    """Points, normals and colours of a binary file with these alone."""
    header, body = path.read_bytes().split(b"end_header\n", 1)
    lines = header.decode().split("\n")
    assert lines[:2] == ["ply", "format binary_little_endian 1.0"], lines[:2]
    count = int(next(line for line in lines if line.startswith("element vertex")).split()[2])
    names = [line.split()[1:] for line in lines if line.startswith("property")]
    assert names == [["float", "x"], ["float", "y"], ["float", "z"], ["float", "nx"], ["float", "ny"],
                     ["float", "nz"], ["uchar", "red"], ["uchar", "green"], ["uchar", "blue"]], names
    assert len(body) == 27 * count
    return [struct.unpack_from("<6f3B", body, 27 * i) for i in range(count)]
