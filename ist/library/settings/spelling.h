#pragma once

#include <span>
#include <string>
#include <string_view>

namespace ist {

/// The word of `known` that was probably meant: no more letters apart than a third of its length,
/// and at most two. Empty if there is none.
std::string nearest_word(std::string_view word, std::span<const std::string> known);

}  // namespace ist
