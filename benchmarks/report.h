#pragma once

#include <ist/gpu.h>

#include <algorithm>
#include <cstdio>
#include <cstdlib>
#include <filesystem>
#include <fstream>
#include <iostream>
#include <nlohmann/json.hpp>
#include <string>
#include <thread>

namespace ist::benchmark {

/// What a benchmark program measured: rows of named tables, targets met or missed, remarks, and
/// where it ran. Written as JSON to the path given by --out; without it, printed. tables.py makes
/// results/README's tables and plots of these files.
class Report {
 public:
  using Json = nlohmann::ordered_json;

  /// A number that a program may be told: [--NAME N].
  struct Count {
    std::string name;
    std::size_t& value;
  };

  /// Arguments: [--out FILE] [--quick] and the program's counts. Ends the program with code 2 on
  /// any other.
  Report(const std::string& name, int argc, char** argv, const std::vector<Count>& counts = {}) {
    for (int i = 1; i < argc; ++i) {
      const std::string argument = argv[i];
      if (argument == "--quick") {
        quick_ = true;
      } else if (argument == "--out" && i + 1 < argc) {
        out_ = argv[++i];
      } else if (const auto count = std::find_if(
                     counts.begin(), counts.end(),
                     [&](const Count& known) { return argument == "--" + known.name; });
                 count != counts.end() && i + 1 < argc) {
        count->value = std::stoul(argv[++i]);
      } else {
        std::cerr << "usage: " << name << " [--out FILE] [--quick]";
        for (const Count& known : counts) std::cerr << " [--" << known.name << " N]";
        std::cerr << "\n";
        std::exit(2);
      }
    }
    json_["benchmark"] = name;
    // A machine that has the programs but no repository is told the commit.
    const char* const commit = std::getenv("IST_COMMIT");
    json_["commit"] = commit != nullptr
                          ? commit
                          : first_line("git -C '" IST_SOURCE_DIR "' describe --always --dirty");
    json_["date"] = first_line("date -u +%F");
    json_["cpu"] = first_line("sed -n 's/^model name.*: //p' /proc/cpuinfo");
    json_["cores"] = std::thread::hardware_concurrency();
    if (gpu_available()) json_["gpu"] = gpu_info().name;
    json_["compiler"] = compiler();
    json_["quick"] = quick_;
    json_["tables"] = Json::object();
    json_["targets"] = Json::array();
    json_["remarks"] = Json::array();
  }

  bool quick() const { return quick_; }

  /// Appends a row, {"column": value, …}, to the table of that title; shows it as it comes.
  void row(const std::string& table, const Json& values) {
    json_["tables"][table].push_back(values);
    std::cerr << table << ": " << values.dump() << "\n";
  }

  /// A figure that has to reach a limit: value ≥ limit, or value ≤ limit if `at_most`.
  void target(const std::string& what, double value, double limit, bool at_most = false) {
    const bool met = at_most ? value <= limit : value >= limit;
    const Json entry = {{"what", what},
                        {"value", value},
                        {"limit", (at_most ? "≤ " : "≥ ") + Json(limit).dump()},
                        {"met", met}};
    json_["targets"].push_back(entry);
    std::cerr << entry.dump() << "\n";
  }

  /// tables.py makes this report a page of its own, NAME.md beside it, under the given title.
  void page(const std::string& title) { json_["page"] = title; }

  /// One sentence that a reader of the figures must know.
  void remark(const std::string& sentence) { json_["remarks"].push_back(sentence); }

  /// Writes the report; the value is main's exit code. A missed target is reported, not an error:
  /// figures differ between machines.
  int write() const {
    if (out_.empty()) {
      std::cout << lines(json_) << "\n";
      return 0;
    }
    std::ofstream file(out_);
    file << lines(json_) << "\n";
    file.close();
    if (!file) {
      std::cerr << "cannot write " << out_ << "\n";
      return 1;
    }
    return 0;
  }

 private:
  /// A line for each row of a table.
  static std::string lines(const Json& json, int open = 3) {
    if (open == 0 || !json.is_structured() || json.empty()) return json.dump();
    std::string out;
    for (const auto& [key, value] : json.items())
      out += (out.empty() ? "\n" : ",\n") + (json.is_object() ? Json(key).dump() + ": " : "") +
             lines(value, open - 1);
    return json.is_object() ? "{" + out + "\n}" : "[" + out + "\n]";
  }

  static std::string compiler() {
#ifdef __clang__
    return "clang " __clang_version__;
#else
    return "g++ " __VERSION__;
#endif
  }

  static std::string first_line(const std::string& command) {
    std::string line;
    if (std::FILE* const pipe = popen((command + " 2>/dev/null").c_str(), "r")) {
      for (int c = std::fgetc(pipe); c != EOF && c != '\n'; c = std::fgetc(pipe)) {
        line.push_back(static_cast<char>(c));
      }
      pclose(pipe);
    }
    return line.empty() ? "unknown" : line;
  }

  Json json_;
  std::filesystem::path out_;
  bool quick_ = false;
};

}  // namespace ist::benchmark
