// Linked into a test program: an operation without a number for an answer (0/0, ∞ − ∞, √−1), a
// division by zero or an overflow ends the program where it happens (SIGFPE), instead of going on
// as NaN or Inf that a later comparison may hide. Threads inherit it from the one that starts them.
// Most ARM64 processors have no such traps: there the programs only run.
#include <gtest/gtest.h>

#include <cfenv>

namespace {

class FloatTraps : public testing::EmptyTestEventListener {
 public:
  // Around each test alone: gtest's and the loader's own arithmetic is not looked at.
  void OnTestStart(const testing::TestInfo&) override {
    feclearexcept(FE_ALL_EXCEPT);
    feenableexcept(kTrapped);
  }
  void OnTestEnd(const testing::TestInfo&) override { fedisableexcept(kTrapped); }

 private:
  static constexpr int kTrapped = FE_INVALID | FE_DIVBYZERO | FE_OVERFLOW;
};

[[maybe_unused]] const bool kListening = [] {
  testing::UnitTest::GetInstance()->listeners().Append(new FloatTraps);
  return true;
}();

}  // namespace
