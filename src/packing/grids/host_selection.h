#pragma once

#include <vector>

#include "packing/grids/prototype_cells.h"

namespace ist::packing {

/// The paper's selection on the host's threads: of the candidates that no neighbouring cell's
/// outdoes, those that no other of them goes before and overlaps. `candidates`: one a cell of
/// `layout`; in no particular order.
std::vector<GridCandidate> selected(const GridLayout& layout,
                                    const std::vector<GridCandidate>& candidates);

}  // namespace ist::packing
