#pragma once

#include <cstddef>
#include <random>
#include <string>

namespace ist::testing {

/// `bytes` with one to three edits: a byte changed, cut off, cut out or doubled, or a number put in
/// that no reader expects.
inline std::string damaged(std::string bytes, std::mt19937_64& random) {
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  static const std::string kOdd[] = {"-1",  "4294967296", "1e999", "nan", "\xff\xff\xff\xff",
                                     "0 0", "\n",         "\0\0",  "{",   "9999999999999999999999"};
  for (std::size_t edits = 1 + below(3); edits > 0 && !bytes.empty(); --edits) {
    const std::size_t at = below(bytes.size());
    switch (below(5)) {
      case 0:
        bytes[at] = static_cast<char>(random());
        break;
      case 1:
        bytes.resize(at);
        break;
      case 2:
        bytes.erase(at, 1 + below(8));
        break;
      case 3:
        bytes.insert(at, bytes.substr(below(bytes.size()), below(40)));
        break;
      case 4:
        bytes.replace(at, 1, kOdd[below(std::size(kOdd))]);
        break;
    }
  }
  return bytes;
}

}  // namespace ist::testing
