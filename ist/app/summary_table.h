#pragma once

#include "library/summary.h"

namespace ist::app {

/// On stdout, as JSON or as a table for a person; nothing where a person wants quiet.
void print_summary(const Summary& summary, bool json, bool quiet);

}  // namespace ist::app
