#include "cli/program.h"

#include <fcntl.h>
#include <poll.h>
#include <sys/resource.h>
#include <sys/wait.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <csignal>
#include <cstdint>
#include <cstdlib>
#include <fstream>
#include <sstream>

extern char** environ;

namespace ist::testing {
namespace {

using Clock = std::chrono::steady_clock;

double seconds_since(Clock::time_point start) {
  return std::chrono::duration<double>(Clock::now() - start).count();
}

std::vector<char*> pointers(std::vector<std::string>& strings) {
  std::vector<char*> result;
  for (std::string& s : strings) result.push_back(s.data());
  result.push_back(nullptr);
  return result;
}

/// Appends the available input to `text`; false at the end of the stream.
bool drain(int descriptor, std::string& text) {
  std::array<char, 4096> buffer;
  const ssize_t got = read(descriptor, buffer.data(), buffer.size());
  if (got <= 0) return false;
  text.append(buffer.data(), static_cast<std::size_t>(got));
  return true;
}

/// A terminal's two ends, as pipe2() gives a pipe's.
void open_terminal(int (&ends)[2]) {
  ends[0] = posix_openpt(O_RDWR | O_NOCTTY | O_CLOEXEC);
  EXPECT_EQ(grantpt(ends[0]), 0);
  EXPECT_EQ(unlockpt(ends[0]), 0);
  ends[1] = open(ptsname(ends[0]), O_RDWR | O_NOCTTY | O_CLOEXEC);
  EXPECT_GE(ends[1], 0);
}

}  // namespace

Outcome run_ist(const std::filesystem::path& folder, const std::vector<std::string>& arguments,
                const RunOptions& options) {
  std::vector<std::string> argv_strings = {IST_BINARY};
  argv_strings.insert(argv_strings.end(), arguments.begin(), arguments.end());
  std::vector<std::string> env_strings(options.environment);
  for (char** entry = environ; *entry != nullptr; ++entry) env_strings.emplace_back(*entry);
  const std::vector<char*> argv = pointers(argv_strings), env = pointers(env_strings);

  int out_pipe[2], err_pipe[2];
  EXPECT_EQ(pipe2(out_pipe, O_CLOEXEC), 0);
  if (options.terminal)
    open_terminal(err_pipe);
  else
    EXPECT_EQ(pipe2(err_pipe, O_CLOEXEC), 0);
  int in_pipe[2];
  EXPECT_EQ(pipe2(in_pipe, O_CLOEXEC), 0);
  const auto input_size = static_cast<ssize_t>(options.input.size());
  EXPECT_EQ(write(in_pipe[1], options.input.data(), options.input.size()), input_size);
  close(in_pipe[1]);
  const Clock::time_point start = Clock::now();
  const pid_t child = fork();
  if (child == 0) {
    if (options.in_child) options.in_child();
    if (dup2(in_pipe[0], STDIN_FILENO) >= 0 && dup2(out_pipe[1], STDOUT_FILENO) >= 0 &&
        dup2(err_pipe[1], STDERR_FILENO) >= 0 && chdir(folder.c_str()) == 0)
      execve(IST_BINARY, argv.data(), env.data());
    _exit(127);
  }
  EXPECT_GT(child, 0);
  close(in_pipe[0]);
  close(out_pipe[1]);
  close(err_pipe[1]);

  Outcome outcome;
  bool interrupted = options.interrupt_after.empty(), stopped = options.stop_after <= 0;
  std::array<pollfd, 2> streams = {pollfd{out_pipe[0], POLLIN, 0}, pollfd{err_pipe[0], POLLIN, 0}};
  while (child > 0 && (streams[0].fd >= 0 || streams[1].fd >= 0)) {
    const double left = options.stop_after - seconds_since(start);
    if (!stopped && left <= 0) {
      kill(child, options.stop_signal);
      stopped = true;
    }
    const auto nanoseconds = static_cast<std::int64_t>(std::max(left, 0.0) * 1e9);
    const timespec wait = {nanoseconds / 1'000'000'000, nanoseconds % 1'000'000'000};
    ppoll(streams.data(), streams.size(), stopped ? nullptr : &wait, nullptr);
    if (streams[0].revents != 0 && !drain(out_pipe[0], outcome.out)) streams[0].fd = -1;
    if (streams[1].revents != 0 && !drain(err_pipe[0], outcome.err)) streams[1].fd = -1;
    if (!interrupted && outcome.err.find(options.interrupt_after) != std::string::npos) {
      kill(child, SIGINT);
      interrupted = true;
    }
  }
  close(out_pipe[0]);
  close(err_pipe[0]);
  int status = 0;
  rusage usage = {};
  if (child > 0) wait4(child, &status, 0, &usage);
  outcome.exit_code = WIFSIGNALED(status) ? 128 + WTERMSIG(status) : WEXITSTATUS(status);
  outcome.peak_memory = static_cast<std::size_t>(usage.ru_maxrss) * 1024;
  return outcome;
}

void CommandLine::SetUp() {
  std::string pattern = (std::filesystem::temp_directory_path() / "ist_cli_XXXXXX").string();
  ASSERT_NE(mkdtemp(pattern.data()), nullptr);
  folder_ = pattern;
  for (const std::string name : {"cube", "capsule"}) {
    ASSERT_EQ(ist({"sample", name, "-o", name + ".obj"}).exit_code, 0);
    const Outcome bake = ist({"bake", name + ".obj", "-o", name + ".ist", "--spheres", "100"});
    ASSERT_EQ(bake.exit_code, 0) << bake.err;
  }
  first_files_ = files();
}

void CommandLine::TearDown() { std::filesystem::remove_all(folder_); }

std::string CommandLine::read(const std::string& name) const {
  std::ifstream file(folder_ / name, std::ios::binary);
  std::ostringstream content;
  content << file.rdbuf();
  return content.str();
}

void CommandLine::write(const std::string& name, const std::string& content) const {
  std::ofstream(folder_ / name, std::ios::binary) << content;
}

std::vector<std::string> CommandLine::files() const {
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder_))
    names.push_back(entry.path().filename().string());
  std::sort(names.begin(), names.end());
  return names;
}

std::vector<std::string> CommandLine::new_files() const {
  std::vector<std::string> names = files();
  std::erase_if(names, [&](const std::string& name) {
    return std::binary_search(first_files_.begin(), first_files_.end(), name);
  });
  return names;
}

std::vector<std::string> lines_of(const std::string& text) {
  std::vector<std::string> lines;
  std::istringstream stream(text);
  for (std::string line; std::getline(stream, line);) lines.push_back(line);
  return lines;
}

std::vector<double> numbers_of(const std::string& csv_row) {
  std::vector<double> numbers;
  std::istringstream stream(csv_row);
  for (std::string field; std::getline(stream, field, ',');) {
    char* end = nullptr;
    const double value = std::strtod(field.c_str(), &end);
    numbers.push_back(end == field.c_str() + field.size() ? value : std::nan(""));
  }
  return numbers;
}

}  // namespace ist::testing
