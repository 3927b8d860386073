#pragma once

#include <cstdint>

#include "library/job.h"

namespace ist {

/// [bytes] that this process may still take: of the machine, and of the control groups it is in.
std::uint64_t available_memory();

/// [bytes] that a job takes at most while it runs, by its mesh file's size and its sphere count: a
/// guess on the safe side.
std::uint64_t memory_of(const Job& job);

}  // namespace ist
