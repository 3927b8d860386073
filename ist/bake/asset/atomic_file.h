#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>

namespace ist {

/// Writes a file whole or not at all: to a temporary one beside it, which is then renamed. A device
/// or a pipe is written to directly. Throws Error (file, reason).
void write_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes);
void write_atomically(const std::filesystem::path& path, std::string_view text);

}  // namespace ist
