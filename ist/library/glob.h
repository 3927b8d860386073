#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace ist {

/// True if a path contains wildcards: * ? [
bool is_pattern(const std::string& path);

/// The matching files, sorted by the bytes of their paths. A relative pattern starts in `folder`
/// ("": the current one), whose own name may contain any characters.
///
/// * and ? match characters of one name, [abc] one of these characters, ** any number of folders,
/// including none. Names that begin with a dot match only patterns that do. Folders that are links
/// are entered by their name or *, not by **.
std::vector<std::filesystem::path> matching_files(const std::filesystem::path& folder,
                                                  const std::filesystem::path& pattern);

/// True if a pattern matches a path, name by name, whether or not the folders exist or are links.
/// Both must be relative to one folder, or both absolute.
bool matches(const std::filesystem::path& path, const std::filesystem::path& pattern);

/// Replaces {stem}, {ext}, {parent} and {dir} in a name by the parts of a file's path: its name
/// without its extension, its extension, its folder's name, and the names of all folders from
/// `root` to it, joined by '-'. Throws Error for any other {word}.
std::string name_for(const std::string& pattern, const std::filesystem::path& file,
                     const std::filesystem::path& root);

}  // namespace ist
