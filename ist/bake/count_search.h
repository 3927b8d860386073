#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace ist {

constexpr std::size_t kMostCounted = 200'000;  ///< spheres, if the caller sets no limit

/// Searches for about the fewest spheres with a sufficient error, in few bakes: each result is the
/// next count to try. The error falls about as 1 / count.
class CountSearch {
 public:
  /// Counts in [1, most]; error > 0.
  CountSearch(double error, std::size_t most) : error_(error), most_(most) {}

  static std::size_t first(std::size_t most);

  /// Records the error of a bake of `count` spheres. Returns the next count, or nothing at the end.
  std::optional<std::size_t> next(std::size_t count, double error);

 private:
  struct Trial {
    std::size_t count = 0;
    double error = 0;
  };

  double guess() const;

  double error_;
  std::size_t most_;
  std::vector<Trial> trials_;   ///< in order
  std::optional<Trial> fails_;  ///< with the most spheres
  std::optional<Trial> does_;   ///< with the fewest
};

}  // namespace ist
