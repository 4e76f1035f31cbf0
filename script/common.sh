# Copyright the Waymark authors.
# SPDX-License-Identifier: Apache-2.0
# Sourced by the scripts beside it: the root of the repository and a few helpers.

set -euo pipefail
root=$(cd "$(dirname "${BASH_SOURCE[0]}")/.." && pwd)

# Compiled once is compiled for every clone and folder on this machine.
export CCACHE_BASEDIR=$root CCACHE_NOHASHDIR=1

die() {
  printf 'error: %s\n' "$*" >&2
  exit 1
}

# Parallel jobs: one per core, but one per 1.5 GB of free memory at most; Eigen and Ceres are hungry.
num_jobs() {
  local cores free_mb by_memory
  cores=$(nproc)
  free_mb=$(awk '/^MemAvailable:/ {print int($2 / 1024)}' /proc/meminfo 2>/dev/null || echo 1500)
  by_memory=$((free_mb / 1500))
  if ((by_memory < 1)); then by_memory=1; fi
  echo $((cores < by_memory ? cores : by_memory))
}

# Own C++ sources, one path a line.
cxx_sources() {
  find "$root/src" "$root/apps" "$root/examples" "$root/benchmarks" "$root/fuzz" "$root/tests" "$root/python" \
    \( -name '*.cc' -o -name '*.h' \) -print | LC_ALL=C sort
}
