#pragma once

#include <map>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "cli/program.h"

namespace ist::testing {

/// A fresh folder a test, with a few small meshes and library.toml, which bakes them with few
/// spheres.
class LibraryFolder : public CommandLine {
 protected:
  void SetUp() override;

  /// `ist bake --manifest MANIFEST -o OUT …`.
  Outcome bake(const std::string& out, const std::vector<std::string>& more = {},
               const RunOptions& options = {}, const std::string& manifest = "library.toml") const;
  /// The same with --json, what it printed.
  nlohmann::json summary_of(const std::string& out, const std::vector<std::string>& more = {},
                            int exit_code = 0) const;

  /// Names and bytes of the files in a folder; none if there is no such folder.
  /// Without names that begin with a dot.
  std::map<std::string, std::string> files_in(const std::string& folder) const;
  /// Entries of a cache.
  std::size_t entries_in(const std::string& cache) const;

  /// The content of library.toml.
  static const std::vector<std::string>& names();
};

}  // namespace ist::testing
