#include "app/interrupt.h"

#include <gtest/gtest.h>

#include <chrono>
#include <csignal>
#include <cstdlib>
#include <thread>

namespace ist::app {
namespace {

void press_and_work_on(int signal, double patience) {
  install_interrupt_handler();
  const InterruptGuard guard(patience);
  std::raise(signal);
  std::this_thread::sleep_for(std::chrono::seconds(10));
  std::exit(0);
}

TEST(Interrupt, PatienceEndsBelowAndAboveASecond) {
  for (const double patience : {0.1, 1.1})
    EXPECT_EXIT(press_and_work_on(SIGINT, patience), ::testing::ExitedWithCode(130), "")
        << patience;
}

TEST(Interrupt, SigtermIsAsCtrlC) {
  EXPECT_EXIT(press_and_work_on(SIGTERM, 0.1), ::testing::ExitedWithCode(130), "");
}

}  // namespace
}  // namespace ist::app
