# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Makes a wheel of the Python module and the program, for pip (PEP 517).

    pip install .
    pip wheel . --no-deps --config-settings build-folder=build/release

Configures and builds in build/wheel, or takes a folder that is configured already. A wheel is for the
Python and the system it was made with: it links the libraries of the distribution.
"""
import base64
import hashlib
import os
import pathlib
import re
import shutil
import subprocess
import sys
import sysconfig
import tempfile
import zipfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
OPTIONS = ("-DCMAKE_BUILD_TYPE=Release", "-DWAYMARK_BUILD_PYTHON=ON", "-DWAYMARK_BUILD_TESTS=OFF",
           "-DWAYMARK_BUILD_BENCHMARKS=OFF", "-DWAYMARK_BUILD_EXAMPLES=OFF")


def version():
    return re.search(r"project\(waymark VERSION ([\d.]+)", (ROOT / "CMakeLists.txt").read_text())[1]


def metadata():
    return (f"Metadata-Version: 2.1\nName: waymark\nVersion: {version()}\n"
            "Summary: Visual SLAM for any camera\nLicense: Apache-2.0\nRequires-Python: >=3.9\n"
            "Requires-Dist: numpy<2\nDescription-Content-Type: text/markdown\n\n"
            + (ROOT / "README.md").read_text())


def tag():
    python = f"cp{sys.version_info.major}{sys.version_info.minor}"
    platform = sysconfig.get_platform().replace("-", "_").replace(".", "_")
    return f"{python}-{python}-{platform}"


def run(*command):
    subprocess.run([str(part) for part in command], check=True)


def install(folder, prefix):
    """Builds and installs module and program; gives the files of the wheel, by name."""
    if folder is None:
        folder = ROOT / "build" / "wheel"
        generator = ["-G", "Ninja"] if shutil.which("ninja") else []
        run("cmake", "-S", ROOT, "-B", folder, *generator, *OPTIONS, f"-DPython3_EXECUTABLE={sys.executable}")
    run("cmake", "--build", folder, "--parallel", os.cpu_count(), "--target", "waymark_python", "waymark")
    for component in ("python", "program"):
        run("cmake", "--install", folder, "--prefix", prefix, "--component", component)
    package = next(prefix.rglob("__init__.py")).parent
    if not (package / f"_waymark{sysconfig.get_config_var('EXT_SUFFIX')}").exists():
        raise RuntimeError(f"{folder}: built for another Python, expected -DPython3_EXECUTABLE={sys.executable}")
    files = {path.relative_to(package.parent).as_posix(): path.read_bytes()
             for path in sorted(package.iterdir()) if path.is_file()}
    files[f"waymark-{version()}.data/scripts/waymark"] = (prefix / "bin/waymark").read_bytes()
    # Of what is compiled into both.
    files[f"waymark-{version()}.dist-info/copyright"] = (pathlib.Path(folder) / "packaging/copyright").read_bytes()
    return files


def row(name, content):
    digest = base64.urlsafe_b64encode(hashlib.sha256(content).digest()).rstrip(b"=").decode()
    return f"{name},sha256={digest},{len(content)}\n"


def information(folder):
    """What a wheel says of itself, by name of the file."""
    return {f"{folder}/LICENSE": (ROOT / "LICENSE").read_bytes(),
            f"{folder}/METADATA": metadata().encode(),
            f"{folder}/WHEEL": ("Wheel-Version: 1.0\nGenerator: waymark\nRoot-Is-Purelib: false\n"
                                f"Tag: {tag()}\n").encode()}


def prepare_metadata_for_build_wheel(metadata_directory, config_settings=None):
    """Spares pip a build."""
    folder = f"waymark-{version()}.dist-info"
    for name, content in information(folder).items():
        path = pathlib.Path(metadata_directory) / name
        path.parent.mkdir(exist_ok=True)
        path.write_bytes(content)
    return folder


def build_wheel(wheel_directory, config_settings=None, metadata_directory=None):
    wheel = f"waymark-{version()}-{tag()}.whl"
    with tempfile.TemporaryDirectory() as prefix:
        files = install((config_settings or {}).get("build-folder"), pathlib.Path(prefix))
    info = f"waymark-{version()}.dist-info"
    files.update(information(info))
    record = "".join(row(name, content) for name, content in files.items()) + f"{info}/RECORD,,\n"
    files[f"{info}/RECORD"] = record.encode()
    with zipfile.ZipFile(pathlib.Path(wheel_directory) / wheel, "w") as archive:
        for name, content in files.items():
            entry = zipfile.ZipInfo(name, (2020, 1, 1, 0, 0, 0))  # Same files, same bytes.
            entry.compress_type = zipfile.ZIP_DEFLATED
            entry.external_attr = (0o100755 if "/scripts/" in name else 0o100644) << 16
            archive.writestr(entry, content)
    return wheel


def build_sdist(sdist_directory, config_settings=None):
    """Sources of one commit."""
    name = f"waymark-{version()}"
    path = pathlib.Path(sdist_directory) / f"{name}.tar.gz"
    run("git", "-C", ROOT, "archive", "--format=tar.gz", f"--prefix={name}/", "-o", path, "HEAD")
    return path.name
