# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Data sets put together from parts of others."""
import bisect
import pathlib
import shutil
import statistics
import struct
import zlib

from .trajectories import Truth, nanoseconds

FIRST_STAMP_NS = 1000 * 10**9


def write_black_png(path, width, height):
    def chunk(kind, data):
        return (struct.pack(">I", len(data)) + kind + data +
                struct.pack(">I", zlib.crc32(kind + data)))
    rows = (b"\0" * (width + 1)) * height
    header = struct.pack(">IIBBBBB", width, height, 8, 0, 0, 0, 0)
    path.write_bytes(b"\x89PNG\r\n\x1a\n" + chunk(b"IHDR", header) +
                     chunk(b"IDAT", zlib.compress(rows)) + chunk(b"IEND", b""))


def png_size(path):
    return struct.unpack(">II", path.read_bytes()[16:24])


def read_listing(path, separator):
    """(stamp text, file name) of each line."""
    rows = (line.split(separator) for line in path.read_text().split("\n"))
    return [(w[0], w[1].strip()) for w in rows if len(w) > 1 and not w[0].startswith("#")]


class Sequence:
    """A recorded sequence: its frames, each with one file per stream (cameras, then depth)."""

    def __init__(self, folder, setup):
        self.folder, self.setup, self.name = folder, setup, folder.name
        self.truth = Truth(folder / "groundtruth.txt")
        if (folder / "mav0").is_dir():
            self._read_euroc(2 if setup == "stereo" else 1)
        elif (folder / "rgb.txt").exists():
            self._read_tum(setup == "rgbd")
        elif (folder / "times.txt").exists():
            self._read_kitti(2 if setup == "stereo" else 1)
        else:
            raise ValueError(f"{folder}: holds no sequence, expected EuRoC, TUM or KITTI layout")
        steps = [b - a for a, b in zip(self.stamps, self.stamps[1:])]
        self.step_ns = round(statistics.median(steps))
        self.rate_hz = 1e9 / self.step_ns

    def __len__(self):
        return len(self.stamps)

    def _read_euroc(self, num_cameras):
        self.streams = [f"mav0/cam{i}/data" for i in range(num_cameras)]
        rows = [read_listing(self.folder / f"mav0/cam{i}/data.csv", ",") for i in range(num_cameras)]
        self.stamps = [int(stamp) for stamp, _ in rows[0]]
        self.files = [[self.folder / stream / name for stream, (_, name) in zip(self.streams, frame)]
                      for frame in zip(*rows)]

    def _read_tum(self, with_depth):
        self.streams = ["rgb", "depth"] if with_depth else ["rgb"]
        rows = read_listing(self.folder / "rgb.txt", " ")
        self.stamps = [nanoseconds(stamp) for stamp, _ in rows]
        self.files = [[self.folder / name] for _, name in rows]
        if with_depth:
            depth = [(nanoseconds(s), n) for s, n in read_listing(self.folder / "depth.txt", " ")]
            stamps = [s for s, _ in depth]
            for stamp, files in zip(self.stamps, self.files):
                i = bisect.bisect_left(stamps, stamp)
                nearest = min(depth[max(0, i - 1):i + 1], key=lambda d: abs(d[0] - stamp))
                files.append(self.folder / nearest[1])

    def _read_kitti(self, num_cameras):
        self.streams = [f"image_{i}" for i in range(num_cameras)]
        self.stamps = [nanoseconds(f"{float(t):.9f}")
                       for t in (self.folder / "times.txt").read_text().split()]
        self.files = [[self.folder / stream / f"{i:06d}.png" for stream in self.streams]
                      for i in range(len(self.stamps))]

    def calibration(self):
        """Of camera 0, as text: the same for sequences that can be mapped as one."""
        chain = (self.folder / "camchain.yaml").read_text()
        return chain.split("cam1:")[0]

    def true_pose(self, index):
        return self.truth.at(self.stamps[index])


class Part:
    """Frames [first, end) of a sequence, each step-th of them; black ones are as from a covered
    lens."""

    def __init__(self, sequence, first, end, is_black=False, step=1):
        self.sequence, self.first, self.end = sequence, first, end
        self.is_black, self.step = is_black, step


class SplicedFrame:
    """A frame of the whole: which part and which frame of its sequence it comes from."""

    def __init__(self, stamp, part, index):
        self.stamp, self.part, self.index = stamp, part, index

    def true_pose(self):
        return self.part.sequence.true_pose(self.index)


def splice(parts, folder, write_image=None):
    """Writes the parts one after another, with the layout, calibration and rate of the first one, and
    returns the frames. Files are links, but those of images where write_image(source, target, index of
    the frame, camera) writes them."""
    first = parts[0].sequence
    shutil.rmtree(folder, ignore_errors=True)
    for stream in first.streams:
        (folder / stream).mkdir(parents=True)
    black = folder / "black.png"
    write_black_png(black, *png_size(first.files[0][0]))
    frames = []
    next_stamp = FIRST_STAMP_NS
    for part in parts:
        for index in range(part.first, part.end, part.step):
            stamp, next_stamp = next_stamp, next_stamp + part.step * first.step_ns
            for camera, (stream, file) in enumerate(zip(first.streams, part.sequence.files[index])):
                target = folder / stream / file_name(first, len(frames), stamp)
                if stream == "depth":
                    target.symlink_to(file.resolve())
                elif part.is_black:
                    target.symlink_to(black)
                elif write_image:
                    write_image(file, target, index, camera)
                else:
                    target.symlink_to(file.resolve())
            frames.append(SplicedFrame(stamp, part, index))
    write_listings(first, frames, folder)
    return frames


def file_name(sequence, number, stamp):
    if sequence.streams[0].startswith("image_"):
        return f"{number:06d}.png"
    return f"{stamp}.png"


def write_listings(sequence, frames, folder):
    """Stamps and calibration, as the layout wants them."""
    def seconds(frame):
        return f"{frame.stamp // 10**9}.{frame.stamp % 10**9:09d}"
    for stream in sequence.streams:
        if stream.startswith("mav0/"):
            rows = "".join(f"{f.stamp},{f.stamp}.png\n" for f in frames)
            camera = pathlib.Path(stream).parent
            (folder / camera / "data.csv").write_text("#timestamp [ns],filename\n" + rows)
        elif not stream.startswith("image_"):
            rows = "".join(f"{seconds(f)} {stream}/{f.stamp}.png\n" for f in frames)
            (folder / f"{stream}.txt").write_text(rows)
    if sequence.streams[0].startswith("image_"):
        (folder / "times.txt").write_text("".join(f"{seconds(f)}\n" for f in frames))
    for name in ("calib.txt", "camchain.yaml", "mav0/cam0/sensor.yaml", "mav0/cam1/sensor.yaml"):
        if (sequence.folder / name).exists() and (folder / name).parent.is_dir():
            shutil.copy(sequence.folder / name, folder / name)
