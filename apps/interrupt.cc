// Copyright the Waymark authors.
// SPDX-License-Identifier: Apache-2.0
#include <signal.h>
#include <unistd.h>

#include "commands.h"

namespace waymark {
namespace {

constexpr int kInterruptedStatus = 130;

// The only global of the program: a signal handler can reach nothing else.
volatile sig_atomic_t interrupted = 0;

extern "C" void handle_interrupt(int which) {
  if (interrupted && which != SIGHUP) _exit(kInterruptedStatus);
  interrupted = 1;
}

}  // namespace

void catch_interrupts() {
  struct sigaction action = {};
  action.sa_handler = handle_interrupt;
  action.sa_flags = SA_RESTART;
  sigaction(SIGINT, &action, nullptr);
  sigaction(SIGTERM, &action, nullptr);
  struct sigaction before = {};
  sigaction(SIGHUP, nullptr, &before);
  if (before.sa_handler != SIG_IGN) sigaction(SIGHUP, &action, nullptr);  // Not under nohup.
}

bool is_interrupted() { return interrupted != 0; }

}  // namespace waymark
