#pragma once

#include <cstddef>
#include <string>
#include <string_view>

namespace ist {

/// A whole file in memory, and its name for messages.
struct SourceFile {
  std::string path;
  std::string bytes;
};

/// Throws Error if the file is missing, a folder, unreadable or empty.
SourceFile read_source_file(const std::string& path);

/// The text behind a UTF-8 byte order mark, or all of it.
std::string_view without_byte_order_mark(std::string_view text);

/// Throws Error if the bytes are clearly not a mesh: an image, an archive, a web page, a Git LFS
/// pointer. The message says which, and how to proceed.
void refuse_other_content(const SourceFile& file);

/// Throws Error if a file named as one of this library's formats begins like another, such as a
/// .glb named .obj.
void refuse_other_format(const SourceFile& file);

/// Throws Error "path: what".
[[noreturn]] void fail(const SourceFile& file, const std::string& what);
[[noreturn]] void fail_at_line(const SourceFile& file, std::size_t line, const std::string& what);

/// The lower-case extension of a file name: ".csv" for "A.CSV".
std::string ending_of(const std::string& path);

/// Words of a file for messages: printable, short, in quotes.
std::string in_quotes(std::string_view word);

/// Decodes "%20" and the like in a URI.
std::string percent_decoded(const std::string& uri);

}  // namespace ist
