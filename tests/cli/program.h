#pragma once

#include <gtest/gtest.h>

#include <csignal>
#include <cstddef>
#include <filesystem>
#include <functional>
#include <string>
#include <vector>

// Runs the real `ist` binary as a user's shell would.

namespace ist::testing {

struct Outcome {
  int exit_code = -1;  ///< 128 + signal if a signal ended it
  std::string out, err;
  std::size_t peak_memory = 0;  ///< [bytes] resident
};

struct RunOptions {
  std::vector<std::string> environment = {};  ///< NAME=value, added to this process's own
  /// Send SIGINT once this text has appeared on stderr; "" = never.
  std::string interrupt_after = {};
  double stop_after = 0;      ///< [s] send stop_signal if it still runs then; 0 = never
  int stop_signal = SIGKILL;  ///< which
  bool terminal = false;      ///< stderr is a terminal
  std::string input = {};     ///< what it reads from standard input, 64 kB at most
  /// Called in the new process before `ist` starts in it.
  std::function<void()> in_child = nullptr;
};

/// Runs `ist` with the arguments in the given folder and waits for its end.
Outcome run_ist(const std::filesystem::path& folder, const std::vector<std::string>& arguments,
                const RunOptions& options = {});

/// A fresh folder a test, with cube.obj, capsule.obj and, baked to 100 spheres, cube.ist and
/// capsule.ist in it.
class CommandLine : public ::testing::Test {
 protected:
  void SetUp() override;
  void TearDown() override;

  Outcome ist(const std::vector<std::string>& arguments, const RunOptions& options = {}) const {
    return run_ist(folder_, arguments, options);
  }
  std::string read(const std::string& name) const;
  void write(const std::string& name, const std::string& content) const;
  bool exists(const std::string& name) const { return std::filesystem::exists(folder_ / name); }
  /// Names of the files that are there now and were not after SetUp(), sorted.
  std::vector<std::string> new_files() const;

  std::filesystem::path folder_;

 private:
  std::vector<std::string> files() const;
  std::vector<std::string> first_files_;
};

std::vector<std::string> lines_of(const std::string& text);
std::vector<double> numbers_of(const std::string& csv_row);

}  // namespace ist::testing
