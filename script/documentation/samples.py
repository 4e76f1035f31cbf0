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
