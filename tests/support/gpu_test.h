#pragma once

#include <gtest/gtest.h>
#include <ist/gpu.h>

#include <string>

namespace ist::testing {

/// A test that needs a GPU: skipped, with the reason, where there is none.
class GpuTest : public ::testing::Test {
 protected:
  void SetUp() override {
    std::string why;
    if (!gpu_available(0, &why)) GTEST_SKIP() << why;
  }
};

}  // namespace ist::testing
