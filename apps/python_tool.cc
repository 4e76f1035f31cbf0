// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include "python_tool.h"

#include <spawn.h>
#include <stdlib.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <memory>
#include <sstream>

#include "waymark/base/check.h"

namespace waymark {
namespace {

/// Goes on to the tool if all of its modules are there; Python itself would say in many words that
/// one is not. The first argument are folders to look in first. Tools say themselves what Dask
/// logs, and threads of Dask's that are left at the end are not waited for.
constexpr const char* kStart = R"(
import importlib, importlib.util, os, signal, sys
signal.signal(signal.SIGINT, signal.SIG_DFL)  # Until the tool hears of it.
sys.path[:0] = [folder for folder in sys.argv[1].split(":") if folder]
for module in ("waymark", *filter(None, sys.argv[3].split(","))):
    if importlib.util.find_spec(module) is None:
        expected = "it installed, or its folder in PYTHONPATH" if module == "waymark" else f"the package python3-{module}"
        print(f"error: {sys.executable}: no module {module}, expected {expected}", file=sys.stderr)
        sys.exit(2)
os.environ.setdefault("DASK_LOGGING", str({"distributed": "critical", "distributed.client": "critical"}))
try:
    tool = importlib.import_module("waymark." + sys.argv[2])
except ImportError as error:
    print(f"error: {sys.executable}: {error}, expected the whole module waymark", file=sys.stderr)
    sys.exit(2)
os._exit(tool.main(sys.argv[4:]))
)";

/// What PYTHONPATH names, and after it the folder of the module of a program, which lies in its
/// build folder or below the same prefix.
std::string module_folders(const std::filesystem::path& program) {
  const char* const named = std::getenv("PYTHONPATH");
  std::string folders = named ? named : "";
  const std::filesystem::path folder = program.parent_path();
  const auto prefix = folder.parent_path();
  for (const auto& modules : {folder / "python", prefix / "lib/python3/dist-packages"}) {
    std::error_code error;
    if (!std::filesystem::exists(modules / "waymark/__init__.py", error)) continue;
    return folders + ":" + modules.string();
  }
  return folders;
}

/// The command line that starts a tool.
std::vector<std::string> command_of(const std::string& module,
                                    const std::string& needed,
                                    const std::vector<std::string>& words) {
  std::error_code error;
  const auto self = std::filesystem::read_symlink("/proc/self/exe", error);
  if (!error) ::setenv("WAYMARK_PROGRAM", self.c_str(), /*overwrite=*/0);
  // Modules of the distribution are for its own Python.
  const char* const python =
      ::access("/usr/bin/python3", X_OK) == 0 ? "/usr/bin/python3" : "python3";
  // Isolated (-I), it and its workers: nothing in the folder where somebody happens to be is run.
  std::vector<std::string> command = {
      python, "-I", "-c", kStart, module_folders(self), module, needed};
  command.insert(command.end(), words.begin(), words.end());
  return command;
}

std::vector<char*> pointers_to(std::vector<std::string>& command) {
  std::vector<char*> pointers;
  for (std::string& word : command) pointers.push_back(word.data());
  pointers.push_back(nullptr);
  return pointers;
}

[[noreturn]] void fail_to_start() {
  throw InputError("python3", "cannot be run, expected Python with the module waymark");
}

/// What a command that reads this text says in all, on either stream.
std::string output_of(std::vector<std::string> command, const std::string& text) {
  std::array<int, 2> ends{};
  const std::unique_ptr<std::FILE, int (*)(std::FILE*)> input(std::tmpfile(), std::fclose);
  if (!input || ::pipe(ends.data()) != 0) fail_to_start();
  std::fwrite(text.data(), 1, text.size(), input.get());
  std::rewind(input.get());
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, fileno(input.get()), STDIN_FILENO);
  for (const int stream : {STDOUT_FILENO, STDERR_FILENO}) {
    posix_spawn_file_actions_adddup2(&actions, ends[1], stream);
  }
  for (const int end : ends) posix_spawn_file_actions_addclose(&actions, end);
  pid_t child = 0;
  const int failure = ::posix_spawnp(
      &child, command[0].c_str(), &actions, nullptr, pointers_to(command).data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  ::close(ends[1]);
  std::string output;
  std::array<char, 4096> buffer{};
  for (ssize_t count = 0; (count = ::read(ends[0], buffer.data(), buffer.size())) > 0;) {
    output.append(buffer.data(), static_cast<std::size_t>(count));
  }
  ::close(ends[0]);
  if (failure != 0) fail_to_start();
  ::waitpid(child, nullptr, 0);
  return output;
}

}  // namespace

void become_python_tool(const std::string& module,
                        const std::string& needed,
                        const std::vector<std::string>& words) {
  std::vector<std::string> command = command_of(module, needed, words);
  ::execvp(command[0].c_str(), pointers_to(command).data());
  fail_to_start();
}

CameraChain read_settings_by_tool(const ConfigSource& source) {
  // The file may be a pipe, which is read once.
  std::istringstream output(
      output_of(command_of("importing", "", {"", source.name, "", "-"}), source.text));
  std::vector<std::string> notes;
  std::string camchain;
  for (std::string line; std::getline(output, line);) {
    if (line.starts_with("error: ")) {
      const std::size_t end = std::min(line.find(": ", 7), line.size() - 2);
      throw InputError(line.substr(7, end - 7), line.substr(end + 2));
    }
    if (line.starts_with("note: ")) {
      notes.push_back(line.substr(6));
    } else {
      camchain += line + "\n";
    }
  }
  auto chain = read_camchain(parse_config({source.name, camchain}));
  if (!chain) throw InputError(source.name, "describes no camera, expected one");
  chain->notes = std::move(notes);
  return *std::move(chain);
}

}  // namespace waymark
