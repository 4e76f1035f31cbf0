# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Runs the code blocks of the pages: commands, programs, settings. What does not run must say so."""
import json
import os
import pathlib
import re
import shutil
import subprocess
import tempfile

from documentation.pages import ROOT
from documentation.samples import make_samples, make_wrapper

LANGUAGES = ("sh", "console", "yaml", "json", "cpp", "cmake", "python", "javascript", "text", "csv")
SECONDS = 300  # Plenty: a machine may be busy.
COMMAND_LINE = re.compile(r"^\s*(\$ )?(waymark|script/\w+|cmake|ffmpeg|python3|pip) ")


class Failure(Exception):
    pass


class Runner:
    """Runs the blocks of one page in one folder, in order, so that they build on each other."""

    def __init__(self, folder, environment):
        self.folder, self.environment = folder, environment

    def check(self, block):
        if block.language not in LANGUAGES:
            raise Failure(f"language '{block.language}', expected one of {', '.join(LANGUAGES)}")
        if block.kind == "not run":
            if not block.value:
                raise Failure("'not run' needs a reason")
        elif block.kind == "from":
            self.is_quoted(block)
        elif block.kind == "file":
            (self.folder / block.value).write_text(block.text)
        elif block.kind != "synopsis":
            getattr(self, f"check_{block.language}")(block)

    def is_quoted(self, block):
        path = ROOT / block.value
        if not path.is_file():
            raise Failure(f"there is no file {block.value}")
        lines = path.read_text(encoding="utf-8").split("\n")
        wanted = [line.strip() for line in block.lines]
        here = [line.strip() for line in lines]
        starts = range(len(here) - len(wanted) + 1)
        if not any(here[i:i + len(wanted)] == wanted for i in starts):
            raise Failure(f"is not a part of {block.value}")

    def execute(self, command, text=None):
        done = subprocess.run(command, input=text, cwd=self.folder, env=self.environment, text=True,
                              stdout=subprocess.PIPE, stderr=subprocess.STDOUT, timeout=SECONDS)
        return done.returncode, done.stdout

    def expect(self, block, command, text=None):
        status, output = self.execute(command, text)
        wanted = int(block.value) if block.kind == "status" else 0
        if status != wanted:
            raise Failure(f"ended with status {status}, expected {wanted}:\n{output[-1500:]}")
        return output

    def check_sh(self, block):
        self.expect(block, ["bash", "-euo", "pipefail", "-c", block.text])

    def check_console(self, block):
        """Lines after "$ " are run one by one; the others are what they print, numbers aside."""
        command, printed = None, []
        for line in [*block.lines, "$ "]:
            if not line.startswith("$ "):
                printed.append(line)
                continue
            if command is not None:
                output = self.execute(["bash", "-uc", command])[1]
                self.compare(command, printed, output)
            command, printed = line[2:], []

    @staticmethod
    def compare(command, printed, output):
        plain = [without_numbers(line) for line in output.split("\n")]
        for line in printed:
            if line.strip() in ("", "..."):
                continue
            if without_numbers(line) not in plain:
                raise Failure(f"'{command}' does not print '{line}' but\n{output[-1500:]}")
            del plain[:plain.index(without_numbers(line)) + 1]

    def check_yaml(self, block):
        path = self.folder / "block.yaml"
        path.write_text(block.text)
        self.expect(block, ["waymark", "config", str(path)])

    def check_json(self, block):
        try:
            json.loads(block.text)
        except ValueError as error:
            raise Failure(f"is no JSON: {error}") from error

    def check_cpp(self, block):
        raise Failure("C++ is quoted from a program that is built: expected <!-- from FILE --> above")

    def check_cmake(self, block):
        self.check_cpp(block)

    def check_python(self, block):
        path = self.folder / "block.py"
        path.write_text(block.text)
        compile(block.text, block.where, "exec")
        if block.kind == "run":
            self.expect(block, ["/usr/bin/python3", str(path), *block.value.split()])

    def check_javascript(self, block):
        path = self.folder / "block.js"
        path.write_text(block.text)
        arguments = block.value.split() if block.kind == "run" else None
        self.expect(block, ["node", *(["--check"] if arguments is None else []), str(path), *(arguments or [])])

    def check_text(self, block):
        for line in block.lines:
            if COMMAND_LINE.match(line):
                raise Failure(f"'{line.strip()}' is a command: expected the language sh, or <!-- synopsis --> above")

    check_csv = check_text


def without_numbers(line):
    return re.sub(r"\d+(\.\d+)?", "#", line).rstrip()


def copy_or_link(source, target):
    """Commands may write into any file but images."""
    (os.link if source.endswith(".png") else shutil.copyfile)(source, target)


def check_blocks(pages, program):
    faults, num_run = [], 0
    with tempfile.TemporaryDirectory(prefix="waymark_docs_") as made:
        samples, bin_folder = pathlib.Path(made) / "samples", pathlib.Path(made) / "bin"
        make_wrapper(bin_folder, program)
        environment = {**os.environ, "PATH": f"{bin_folder}:{os.environ['PATH']}", "LC_ALL": "C.UTF-8",
                       "PYTHONPATH": str(program.parent / "python"), "PYTHONDONTWRITEBYTECODE": "1"}
        make_samples(samples, environment)
        for number, page in enumerate(pages.values()):
            folder = pathlib.Path(made) / f"page{number}"
            shutil.copytree(samples, folder, copy_function=copy_or_link, symlinks=True)
            runner = Runner(folder, environment)
            for block in page.blocks:
                num_run += 1
                try:
                    runner.check(block)
                except (Failure, SyntaxError, subprocess.TimeoutExpired) as failure:
                    faults.append(f"{block.where}: {block.language or 'code'}: {failure}")
            shutil.rmtree(folder)
    print(f"{num_run} code blocks")
    return faults
