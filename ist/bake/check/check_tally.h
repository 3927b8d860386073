#pragma once

#include <ist/bake.h>
#include <tbb/parallel_for.h>
#include <cstddef>
#include <limits>
#include <string>
#include <utility>
#include <vector>

namespace ist {

/// Collects the worst value of one invariant; a value > 0 is a violation.
struct Tally {
  double worst = -std::numeric_limits<double>::infinity();
  std::size_t where = 0;
  std::size_t checked = 0;
  std::size_t violations = 0;

  void add(double value, std::size_t index) {
    ++checked;
    if (!(value <= 0)) ++violations;  // NaN is one too
    if (!(value <= worst)) {
      worst = value;
      where = index;
    }
  }

  void add(const Tally& other) {
    checked += other.checked;
    violations += other.violations;
    if (!(other.worst <= worst)) {
      worst = other.worst;
      where = other.where;
    }
  }

  Invariant named(std::string name, std::string meaning) const {
    return {std::move(name), checked == 0 ? 0 : worst, std::move(meaning), where, checked,
            violations};
  }
};

inline void append(std::vector<Invariant>& all, std::vector<Invariant> more) {
  for (Invariant& one : more) all.push_back(std::move(one));
}

/// Runs visit(i, tally) for i < count on all threads; the sum does not depend on how many.
template <class Visit>
Tally tally_all(std::size_t count, const Visit& visit) {
  std::vector<Tally> parts(count);
  tbb::parallel_for(std::size_t{0}, count, [&](std::size_t i) { visit(i, parts[i]); });
  Tally sum;
  for (const Tally& part : parts) sum.add(part);
  return sum;
}

}  // namespace ist
