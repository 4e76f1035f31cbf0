# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
"""Holds docs/cli.md against `waymark --help`, both ways, and docs/settings.md against `waymark config`."""
import re
import subprocess

from documentation.pages import ROOT

CLI_PAGE = ROOT / "docs" / "cli.md"
SETTINGS_PAGE = ROOT / "docs" / "settings.md"
# In --help an option begins its line; in the page it stands in the first cell of a row of a table.
OPTION = re.compile(r"^  (?:-\w,)?(--[\w-]+)")
POSITIONAL = re.compile(r"^  ([A-Z][A-Z_]*)\b")
ROW = re.compile(r"^\| *(`[^|]*)\|")
SETTINGS_HEAD = """# Settings

<!-- Written by script/docs settings. -->

Every setting of Waymark, as `waymark config` lists them. They go into the YAML file that `-c` names, below or beside the cameras
([calibration.md](calibration.md)), or onto the command line as `--set KEY=VALUE`. An unknown key, a value of the wrong type or out of range is
an error that names file, line and what was expected. There are few on purpose: what can be derived from the camera or measured while
running is not a setting. Which of them matter for speed says [performance.md](performance.md).

Below `experiment` the constants of the stages can be changed without a build, as `--set experiment.tracking.keyframes.max_pending=3`. They are for
trials: not listed here, free to change with any version, each with its reason where it is kept ([tracking](../src/waymark/track/options.h),
[mapping](../src/waymark/mapping/options.h), [loops](../src/waymark/loop/options.h)).

"""


def run(program, *arguments):
    done = subprocess.run([program, *arguments], capture_output=True, text=True, timeout=60)
    if done.returncode:
        raise RuntimeError(f"waymark {' '.join(arguments)}: status {done.returncode}, {done.stderr}")
    return done.stdout


def commands(program, command=()):
    """Every command, with the names of its options and positional arguments."""
    found, section, names, below = {}, "", set(), []
    for line in run(program, *command, "--help").split("\n"):
        if line and not line.startswith(" "):
            section = line
        elif section == "Subcommands:" and re.match(r"^  \w", line):
            below.append(line.split()[0])
        elif section.endswith(":") and OPTION.match(line):  # Options stand in groups of their own names.
            names.add(OPTION.match(line)[1])
        elif section == "Positionals:" and POSITIONAL.match(line):
            names.add(POSITIONAL.match(line)[1])
    found[command] = names - {"--help", "--version"}
    for name in below:
        found.update(commands(program, (*command, name)))
    return found


def documented():
    """The same from the page: per heading `waymark NAME` what its tables name first."""
    found, current = {}, None
    for number, line in enumerate(CLI_PAGE.read_text(encoding="utf-8").split("\n"), 1):
        heading = re.match(r"^#+ (.*)", line)
        if heading:
            command = re.match(r"^`?waymark((?: [a-z]+)+)`?$", heading[1])
            current = tuple(command[1].split()) if command else None
            if current:
                found[current] = (number, set())
        row = ROW.match(line)
        if current and row:
            found[current][1].update(re.findall(r"--[\w-]+|\b[A-Z][A-Z_]*\b", row[1])[:1])
    return found


def check_commands(program):
    stated, faults = documented(), []
    name = CLI_PAGE.relative_to(ROOT)
    for command, options in commands(program).items():
        if not options and not command:
            continue
        if command not in stated:
            if options:
                faults.append(f"{name}:1: there is no section 'waymark {' '.join(command)}'")
            continue
        line, written = stated.pop(command)
        faults += [f"{name}:{line}: {option} is missing" for option in sorted(options - written)]
        faults += [f"{name}:{line}: {option} is unknown to --help" for option in sorted(written - options)]
    faults += [f"{name}:{line}: waymark {' '.join(command)} does not exist"
               for command, (line, _) in stated.items()]
    return faults


def settings_page(program):
    return SETTINGS_HEAD + run(program, "config", "--markdown")


def check_settings(program):
    if SETTINGS_PAGE.exists() and SETTINGS_PAGE.read_text(encoding="utf-8") == settings_page(program):
        return []
    return [f"{SETTINGS_PAGE.relative_to(ROOT)}:1: is not what the program prints; run script/docs settings"]
