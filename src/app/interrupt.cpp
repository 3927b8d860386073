#include "app/interrupt.h"

#include <unistd.h>

#include <csignal>

#include "app/commands.h"

namespace ist::app {
namespace {

volatile std::sig_atomic_t guarded = 0;
volatile std::sig_atomic_t pressed = 0;

void on_interrupt(int) {
  if (guarded == 0 || pressed != 0) _exit(kExitInterrupted);
  pressed = 1;
}

}  // namespace

void install_interrupt_handler() { std::signal(SIGINT, on_interrupt); }

InterruptGuard::InterruptGuard() { guarded = 1; }
InterruptGuard::~InterruptGuard() { guarded = 0; }

bool interrupted() { return pressed != 0; }

void exit_if_interrupted() {
  if (interrupted()) throw ExitCode{kExitInterrupted};
}

}  // namespace ist::app
