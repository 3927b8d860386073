#pragma once

#include <cstddef>
#include <filesystem>
#include <span>
#include <string_view>

namespace ist {

/// Writes a whole file: to a temporary one beside it, then renames, so that at every moment the old
/// file or the new one is there. What is no regular file (a device, a pipe) is written to as it is.
/// Throws Error (file, reason).
void write_atomically(const std::filesystem::path& path, std::span<const std::byte> bytes);
void write_atomically(const std::filesystem::path& path, std::string_view text);

}  // namespace ist
