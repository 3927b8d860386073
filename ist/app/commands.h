#pragma once

#include <CLI/CLI.hpp>
#include <chrono>

// The subcommands of `ist`. Each function adds one with its options; its callback does the work. A
// callback throws ist::Error for errors (exit 1) and ExitCode to end with another code.

namespace ist::app {

inline constexpr int kExitError = 1;
inline constexpr int kExitUsage = 2;
inline constexpr int kExitViolation = 3;
inline constexpr int kExitInterrupted = 130;

struct ExitCode {
  int value;
};

inline double seconds_since(std::chrono::steady_clock::time_point start) {
  return std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

void add_bake(CLI::App& app);
void add_cache(CLI::App& app);
void add_summary(CLI::App& app);
void add_query(CLI::App& app);
void add_info(CLI::App& app);
void add_check(CLI::App& app);
void add_clash(CLI::App& app);
void add_medial(CLI::App& app);
void add_export(CLI::App& app);
void add_sample(CLI::App& app);
void add_spheres(CLI::App& app);
void add_reference(CLI::App& app);  ///< completion and manual, for all commands added before

}  // namespace ist::app
