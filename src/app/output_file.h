#pragma once

#include <string>

namespace ist::app {

/// Throws Error if a file cannot be made at `path`, or is `input` itself: before the work, not
/// after it. `what`: what the file is for, "the asset".
void require_output(const std::string& path, const std::string& input, const std::string& what);

}  // namespace ist::app
