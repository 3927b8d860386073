#pragma once

#include <cstddef>
#include <optional>
#include <vector>

namespace ist {

constexpr std::size_t kMostCounted = 200'000;  ///< spheres, where the caller sets no limit

/// Looks for about the fewest spheres whose error does, in few bakes: each answer is the next count
/// to try. The error falls about as 1 / count.
class CountSearch {
 public:
  /// Counts in [1, most]; error > 0.
  CountSearch(double error, std::size_t most) : error_(error), most_(most) {}

  static std::size_t first(std::size_t most);

  /// Takes the error of a bake of `count` spheres. Returns the next count, or nothing at the end.
  std::optional<std::size_t> next(std::size_t count, double error);

 private:
  struct Trial {
    std::size_t count = 0;
    double error = 0;
  };

  double guess() const;

  double error_;
  std::size_t most_;
  std::vector<Trial> trials_;   ///< in the order they came
  std::optional<Trial> fails_;  ///< of most spheres
  std::optional<Trial> does_;   ///< of fewest
};

}  // namespace ist
