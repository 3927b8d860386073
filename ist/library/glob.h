#pragma once

#include <filesystem>
#include <string>
#include <vector>

namespace ist {

/// Whether a path contains characters that stand for others: * ? [
bool is_pattern(const std::string& path);

/// The files that match, in the order of their paths' bytes. A relative pattern starts in `folder`
/// ("": here), whose own name may contain any characters.
///
/// * and ? stand for characters of one name, [abc] for one of them, ** for any number of folders,
/// none too. What begins with a dot is found only by a pattern that does. Folders that are links
/// are entered by their name or *, not by **.
std::vector<std::filesystem::path> matching_files(const std::filesystem::path& folder,
                                                  const std::filesystem::path& pattern);

/// Whether a path is one that the pattern stands for, folder by folder, whatever the folders are:
/// those that are links too. Both relative to one folder, or both absolute.
bool matches(const std::filesystem::path& path, const std::filesystem::path& pattern);

/// A name in which {stem}, {ext}, {parent} and {dir} stand for the parts of a file's path: its name
/// without and with its extension alone, its folder's name, and the names of all folders from
/// `root` to it, joined by '-'. Throws Error for any other {word}.
std::string name_for(const std::string& pattern, const std::filesystem::path& file,
                     const std::filesystem::path& root);

}  // namespace ist
