#pragma once

#include <filesystem>
#include <string>

namespace ist {

/// A name in which {stem}, {ext}, {parent} and {dir} stand for the parts of a file's path: its name
/// without and with its extension alone, its folder's name, and the names of all folders from
/// `root` to it, joined by '-'. Throws Error for any other {word}.
std::string name_for(const std::string& pattern, const std::filesystem::path& file,
                     const std::filesystem::path& root);

}  // namespace ist
