#include "app/interrupt.h"

#include <sys/time.h>
#include <unistd.h>
#include <csignal>

#include "app/commands.h"

namespace ist::app {
namespace {

volatile std::sig_atomic_t guarded = 0;
volatile std::sig_atomic_t pressed = 0;
volatile std::sig_atomic_t patience_us = 0;

void on_timer(int) { _exit(kExitInterrupted); }

void set_timer(std::sig_atomic_t microseconds) {
  itimerval timer = {};
  timer.it_value = {microseconds / 1'000'000, microseconds % 1'000'000};
  setitimer(ITIMER_REAL, &timer, nullptr);
}

void on_interrupt(int) {
  if (guarded == 0 || pressed != 0) _exit(kExitInterrupted);
  pressed = 1;
  if (patience_us != 0) set_timer(patience_us);
}

}  // namespace

void install_interrupt_handler() {
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);  // from Slurm, Kubernetes and timeout
  std::signal(SIGALRM, on_timer);
}

InterruptGuard::InterruptGuard(double patience) {
  patience_us = static_cast<std::sig_atomic_t>(1e6 * patience);
  guarded = 1;
}
InterruptGuard::~InterruptGuard() {
  guarded = 0;
  patience_us = 0;
  set_timer(0);
}

bool interrupted() { return pressed != 0; }

void exit_if_interrupted() {
  if (interrupted()) throw ExitCode{kExitInterrupted};
}

}  // namespace ist::app
