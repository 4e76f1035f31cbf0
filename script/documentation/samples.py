# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Small simulated inputs under the names that the pages use, so that their commands run."""
import pathlib
import subprocess

ROOT = pathlib.Path(__file__).resolve().parent.parent.parent
CAMERA = """cam0:
  camera_model: pinhole
  intrinsics: [290, 291, 187, 121]
  distortion_model: radtan
  distortion_coeffs: [-0.2, 0.05, 0.0002, -0.0001]
  resolution: [376, 240]
"""
PAIR = CAMERA + CAMERA.replace("cam0", "cam1") + (
    "  T_cn_cnm1: [[1, 0, 0, -0.2], [0, 1, 0, 0.003], [0, 0, 1, 0], [0, 0, 0, 1]]\n")
GLOBE = """cam0:
  camera_model: equirectangular
  resolution: [640, 320]
"""
# Ports are free ones, views end by themselves, cameras of the machine are left alone.
WRAPPER = """#!/usr/bin/env bash
arguments=()
for argument in "$@"; do
  case $argument in
  8080 | *:8080) argument=${{argument/%8080/0}} ;;
  camera:* | /dev/video*) echo "a camera of this machine" >&2 && exit 99 ;;
  esac
  arguments+=("$argument")
done
[[ ${{1:-}} == view ]] || exec {program} "${{arguments[@]}}"
coproc {program} "${{arguments[@]}}" --port 0
server=$COPROC_PID printed=${{COPROC[0]}}
while read -r line <&"$printed"; do
  echo "$line"
  [[ $line == *"Ctrl-C ends" ]] && kill -TERM "$server"
done
wait "$server"
"""


def make_wrapper(folder, program):
    folder.mkdir()
    wrapper = folder / "waymark"
    wrapper.write_text(WRAPPER.format(program=program))
    wrapper.chmod(0o755)


def make_samples(folder, environment):
    folder.mkdir()

    def run(*command):
        subprocess.run([str(word) for word in command], cwd=folder, env=environment, check=True,
                       capture_output=True, text=True, timeout=300)

    def simulate(world, name, camera, *arguments):
        (folder / "camera.yaml").write_text(camera)
        run("waymark", "simulate", world, "--camera", "camera.yaml", "--frames", 40, "--quiet", "-o", name, *arguments)
        (folder / "camera.yaml").unlink()

    for link in ("script", "examples"):
        (folder / link).symlink_to(ROOT / link)
    simulate("room", "MH_01_easy", PAIR, "--motion", "inspect")
    add_euroc_truth(folder / "MH_01_easy")
    simulate("room", "desk", CAMERA, "--motion", "inspect", "--setup", "rgbd")
    simulate("room", "globe", GLOBE, "--motion", "slide", "--setup", "mono")
    make_photos(folder)
    run("ffmpeg", "-v", "error", "-framerate", 20, "-i", "photos/%06d.png", "-c:v", "mpeg4", "-q:v", 1, "walk.mp4")
    (folder / "camchain.yaml").write_text(CAMERA)
    make_pairs(folder)
    for side in ("left", "right"):
        run("ffmpeg", "-v", "error", "-framerate", 20, "-i", f"{side}/%06d.png", "-c:v", "mpeg4", "-q:v", 1, f"{side}.mp4")
    run("ffmpeg", "-v", "error", "-f", "lavfi", "-i", "color=white:s=376x240", "-frames:v", 1, "hood.png")
    run("waymark", "run", "MH_01_easy", "--quiet", "--keep-images", "--map-out", "office.wmap")
    run("waymark", "run", "MH_01_easy", "--quiet", "--frames", 25, "--map-out", "monday.wmap")
    run("waymark", "run", "MH_01_easy", "--quiet", "--first", 15, "--map-out", "tuesday.wmap")
    run("waymark", "run", "walk.mp4", "-c", "camchain.yaml", "--quiet", "--keep-images", "--map-out", "walk.wmap")
    run("waymark", "run", "globe", "-c", "globe/camchain.yaml", "--quiet", "--keep-images", "--map-out", "globe.wmap")


def make_photos(folder):
    """The left images as a plain folder of numbered images, half of them also without order."""
    images = sorted((folder / "MH_01_easy" / "mav0" / "cam0" / "data").glob("*.png"))
    for name, chosen in (("photos", images), ("snapshots", images[::8])):
        (folder / name).mkdir()
        for i, image in enumerate(chosen):
            (folder / name / f"{i:06d}.png").write_bytes(image.read_bytes())


def copy_numbered(images, target, name="{:06d}"):
    target.mkdir(parents=True, exist_ok=True)
    for i, image in enumerate(sorted(images)):
        (target / (name.format(i) + image.suffix)).write_bytes(image.read_bytes())


def make_pairs(folder):
    """Two folders of a stereo pair, colour and depth in two folders, a drive of KITTI raw and a scene of Replica."""
    (folder / "pair.yaml").write_text(PAIR)
    drive = folder / "2011_09_26" / "2011_09_26_drive_0001_sync"
    times = "".join(f"2011-09-26 13:02:{25 + i // 20}.{i % 20 * 50:03d}000000\n" for i in range(40))
    rows = ["S_rect_0{0}: 376 240", "P_rect_0{0}: 290 0 187 {1} 0 290 121 0 0 0 1 0"]
    drive.mkdir(parents=True)
    (drive.parent / "calib_cam_to_cam.txt").write_text(
        "\n".join(row.format(camera, -58 * camera) for camera in (0, 1) for row in rows) + "\n")
    for camera, side in ((0, "left"), (1, "right")):
        images = list((folder / "MH_01_easy" / "mav0" / f"cam{camera}" / "data").glob("*.png"))
        copy_numbered(images, folder / side)
        copy_numbered(images, drive / f"image_0{camera}" / "data", "{:010d}")
        (drive / f"image_0{camera}" / "timestamps.txt").write_text(times)
    for name, kind in (("rgb", "frame"), ("depth", "depth")):
        images = list((folder / "desk" / name).glob("*.png"))
        copy_numbered(images, folder / name)
        copy_numbered(images, folder / "Replica" / "room0" / "results", kind + "{:06d}")
    (folder / "Replica" / "cam_params.json").write_text(
        '{"camera": {"w": 376, "h": 240, "fx": 290, "fy": 291, "cx": 187, "cy": 121, "scale": 1000}}\n')


def add_euroc_truth(folder):
    """The ground truth where EuRoC has it; rig and body are one here."""
    target = folder / "mav0" / "state_groundtruth_estimate0"
    target.mkdir()
    rows = ["#timestamp, p_x, p_y, p_z, q_w, q_x, q_y, q_z"]
    for line in (folder / "groundtruth.txt").read_text().split("\n"):
        if line and not line.startswith("#"):
            t, x, y, z, qx, qy, qz, qw = line.split()
            seconds, _, fraction = t.partition(".")
            rows.append(f"{seconds}{fraction.ljust(9, '0')[:9]},{x},{y},{z},{qw},{qx},{qy},{qz}")
    (target / "data.csv").write_text("\n".join(rows) + "\n")
