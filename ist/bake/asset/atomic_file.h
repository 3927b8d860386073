#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>

namespace ist {

/// Writes a file completely or not at all: to a temporary file beside it, which is then renamed.
/// Writes to a device or a pipe directly. Throws Error (file, reason).
void write_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes);
void write_atomically(const std::filesystem::path& path, std::string_view text);

}  // namespace ist
