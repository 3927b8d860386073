#pragma once

#include <cstddef>
#include <span>
#include <string>
#include <string_view>

namespace ist {

/// The word for an enumerator; `words` are in the order of the enum, whose values count from 0.
template <class Enum, std::size_t kCount>
constexpr const char* word_of(Enum value, const char* const (&words)[kCount]) noexcept {
  const auto place = static_cast<std::size_t>(value);
  return place < kCount ? words[place] : "unknown";
}

/// The word of `known` that was probably meant: it differs by at most a third of its length, and at
/// most two letters. Empty if there is none.
std::string nearest_word(std::string_view word, std::span<const std::string> known);

}  // namespace ist
