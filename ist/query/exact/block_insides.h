#pragma once

#include <cstdint>

#include <ist/asset_layout.h>

#include "base/bits.h"
#include "base/host_device.h"

namespace ist {

/// The vertices of a crossed block that are inside the other solid, a bit for each local vertex.
/// Those of pierced edges follow from what pierces them, the others from edges that nothing
/// pierces.
struct BlockInsides {
  std::uint32_t known = 0, inside = 0;
  std::uint32_t joined[kWidth] =
      {};  ///< of a vertex: those joined to it by edges that nothing pierces

  BlockInsides() = default;

  /// `pierced`: bit 3 · lane + edge. `sum(edge)`: its entries less its exits. `first(edge)`: 1 if
  /// it enters first, −1 if it leaves first, 0 if unclear.
  template <class Sum, class First>
  IST_HD BlockInsides(const MeshBlock& mesh, std::uint64_t pierced, const Sum& sum,
                      const First& first) {
    std::uint32_t found = 0;
    for (std::uint64_t left = pierced; left != 0; left &= left - 1) {
      const auto edge = static_cast<std::uint32_t>(lowest_bit(left));
      const std::uint32_t p = mesh.corner[edge % 3][edge / 3],
                          q = mesh.corner[(edge + 1) % 3][edge / 3];
      const int net = sum(edge), comes_first = first(edge);
      const bool leaves = (net == 0) & (comes_first < 0);  // and enters again
      const auto clear = static_cast<std::uint32_t>((net != 0) | (comes_first != 0));
      found |= clear << p | clear << q;
      inside |= static_cast<std::uint32_t>((net < 0) | leaves) << p |
                static_cast<std::uint32_t>((net > 0) | leaves) << q;
    }
    known = found;
    if (found == (1u << mesh.vertices) - 1) return;
    for (std::uint32_t t = 0; t < mesh.triangles; ++t) {
      const std::uint32_t v[3] = {mesh.corner[0][t], mesh.corner[1][t], mesh.corner[2][t]};
      const auto other_end = [&](std::uint32_t edge, std::uint32_t end) {
        return static_cast<std::uint32_t>(~pierced >> (3 * t + edge) & 1) << v[end];
      };
      joined[v[0]] |= other_end(0, 1) | other_end(2, 2);
      joined[v[1]] |= other_end(0, 0) | other_end(1, 2);
      joined[v[2]] |= other_end(1, 1) | other_end(2, 0);
    }
    spread(found);
  }

  /// Spreads the state of known vertices along edges that nothing pierces.
  IST_HD void spread(std::uint32_t from) {
    known |= from;
    while (from != 0) {
      const auto v = static_cast<std::uint32_t>(lowest_bit(from));
      from &= from - 1;
      const std::uint32_t reached = joined[v] & ~known;
      known |= reached;
      from |= reached;
      if (inside >> v & 1) inside |= reached;
    }
  }

  /// A vertex whose state is unknown, because it is unclear what pierces an edge first; 16 if there
  /// is none.
  IST_HD std::uint32_t unknown(const MeshBlock& mesh) const {
    const std::uint32_t left = ((1u << mesh.vertices) - 1) & ~known;
    return left == 0 ? kWidth : static_cast<std::uint32_t>(lowest_bit(left));
  }
  IST_HD void tell(std::uint32_t vertex, bool is_inside) {
    inside |= static_cast<std::uint32_t>(is_inside) << vertex;
    spread(1u << vertex);
  }
};

}  // namespace ist
