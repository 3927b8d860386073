#pragma once

#include <string>

#include "library/summary.h"

namespace ist::app {

/// A page of a library for a browser, all in one file: a table with a picture of each asset that
/// keeps its mesh and can be read, failures first.
std::string summary_page(const Summary& summary);

}  // namespace ist::app
