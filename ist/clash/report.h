#pragma once

#include <nlohmann/json.hpp>
#include <set>
#include <utility>

#include "clash/clash.h"

namespace ist {

struct ClashReport {
  using Names = std::pair<std::string, std::string>;  ///< of two parts, sorted

  std::size_t parts = 0;  ///< also those with faults
  std::vector<std::string> names;
  std::span<const Clash> pairs;
  double tolerance = -1;                                    ///< [u³] below 0: not asked for
  bool swept = false;                                       ///< over several poses
  std::vector<std::pair<std::string, std::string>> faults;  ///< part, what
  std::vector<std::string> notes;
  bool compared = false;    ///< with an earlier run
  std::set<Names> earlier;  ///< its clashes

  Names names_of(const Clash& clash) const;
  /// "certainly above" the tolerance, "certainly below" it, or "undecided".
  const char* verdict(const Clash& clash) const;
  /// It overlaps, and not certainly below the tolerance.
  bool is_clash(const Clash& clash) const;
  std::size_t new_clashes() const;
  std::vector<Names> resolved() const;
};

nlohmann::ordered_json clashes_json(const ClashReport& report);  ///< docs/json.md
std::string clashes_csv(const ClashReport& report);
std::string clashes_text(const ClashReport& report);
/// With five digits, and a tenth of a unit however far from the origin.
std::string place_text(const Eigen::Vector3d& x);

/// The clashes of a report of `ist clash --json`. Throws Error where the file is none.
std::set<ClashReport::Names> read_clashes(const std::string& path);

/// A zip of the BIM Collaboration Format 2.1: a topic a clash, with a viewpoint. A pair of names
/// has the same topic in every run. `date`: ISO 8601.
std::string clashes_bcf(const ClashReport& report, const std::string& date);

const char* name_of(ClashKind kind) noexcept;

}  // namespace ist
