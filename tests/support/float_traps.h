#pragma once

#include <cfenv>

namespace ist::testing {

/// For tests that hand in NaN, Inf or what overflows: within its life nothing is trapped
/// (float_traps.cpp).
class NoFloatTraps {
 public:
  NoFloatTraps() : trapped_(fegetexcept()) { fedisableexcept(trapped_); }
  ~NoFloatTraps() {
    feclearexcept(FE_ALL_EXCEPT);
    feenableexcept(trapped_);
  }
  NoFloatTraps(const NoFloatTraps&) = delete;
  NoFloatTraps& operator=(const NoFloatTraps&) = delete;

 private:
  int trapped_;
};

}  // namespace ist::testing
