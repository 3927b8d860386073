#include "library/settings/spelling.h"

#include <algorithm>
#include <vector>

namespace ist {
namespace {

/// The number of letters to change, remove or insert, or of neighbours to swap.
std::size_t letters_apart(std::string_view a, std::string_view b) {
  std::vector<std::size_t> row(b.size() + 1), above = row, second = row;
  for (std::size_t j = 0; j <= b.size(); ++j) row[j] = j;
  for (std::size_t i = 1; i <= a.size(); ++i) {
    second.swap(above);
    above.swap(row);
    row[0] = i;
    for (std::size_t j = 1; j <= b.size(); ++j) {
      row[j] =
          std::min({above[j - 1] + (a[i - 1] == b[j - 1] ? 0 : 1), above[j] + 1, row[j - 1] + 1});
      if (i > 1 && j > 1 && a[i - 1] == b[j - 2] && a[i - 2] == b[j - 1])
        row[j] = std::min(row[j], second[j - 2] + 1);
    }
  }
  return row[b.size()];
}

}  // namespace

std::string nearest_word(std::string_view word, std::span<const std::string> known) {
  std::string nearest;
  std::size_t least = 3;
  for (const std::string& one : known) {
    const std::size_t apart = letters_apart(word, one);
    if (apart >= least || 3 * apart > one.size()) continue;
    least = apart;
    nearest = one;
  }
  return nearest;
}

}  // namespace ist
