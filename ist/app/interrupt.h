#pragma once

namespace ist::app {

/// Ctrl-C or SIGTERM ends the program with exit code 130 at once, unless an InterruptGuard exists.
void install_interrupt_handler();

/// While a guard exists, the first Ctrl-C only sets interrupted(), so that a long stage can end
/// cleanly and no temporary file remains; the second ends the program.
///
/// `patience` [s]: a stage that has not ended so long after the first is ended as by the second; 0:
/// waits for it. Not for stages that write files.
class InterruptGuard {
 public:
  explicit InterruptGuard(double patience = 0);
  ~InterruptGuard();
  InterruptGuard(const InterruptGuard&) = delete;
  InterruptGuard& operator=(const InterruptGuard&) = delete;
};

bool interrupted();

/// Throws ExitCode 130 if Ctrl-C was pressed.
void exit_if_interrupted();

}  // namespace ist::app
