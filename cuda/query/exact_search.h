#pragma once

#include <cmath>
#include <cstdint>

#include "cuda/query/exact_memory.h"
#include "numerics/team.h"

namespace ist::gpu {

constexpr std::uint32_t kNoRoom = 0xFFFFFFFFu;

/// The box around sixteen.
template <class Team>
struct BoxOfAll {
  float low[3], high[3];
  IST_HD BoxOfAll(const Team& team, const float (&lows)[3][kWidth],
                  const float (&highs)[3][kWidth]) {
    for (int k = 0; k < 3; ++k) {
      float least = kExactFar, most = -kExactFar;
      for (int l = team.lane(); l < static_cast<int>(kWidth); l += Team::kWidth) {
        least = std::fmin(least, lows[k][l]);
        most = std::fmax(most, highs[k][l]);
      }
      low[k] = team.min(least);
      high[k] = team.max(most);
    }
  }
};

/// Lists of each side the boxes that come within `reach` of the box around all of the other side,
/// which is in this side's frame; how many pairs are left. All of a team together.
template <class Team>
IST_HD int narrow_sides(const Team& team, ExactMemory& memory, const float (&low_a)[3][kWidth],
                        const float (&high_a)[3][kWidth], const float (&low_by_a)[3][kWidth],
                        const float (&high_by_a)[3][kWidth], float reach_a,
                        const float (&low_b)[3][kWidth], const float (&high_b)[3][kWidth],
                        const float (&low_by_b)[3][kWidth], const float (&high_by_b)[3][kWidth],
                        float reach_b) {
  const BoxOfAll<Team> by_a(team, low_by_a, high_by_a), by_b(team, low_by_b, high_by_b);
  int left[2] = {0, 0};
  constexpr int kBoth = 2 * static_cast<int>(kWidth);
  for (int first = 0; first < kBoth; first += Team::kWidth) {
    const int k = first + team.lane();
    const bool of_b = k >= static_cast<int>(kWidth);
    const auto l = static_cast<std::uint32_t>(k) % kWidth;
    const float(&low)[3][kWidth] = of_b ? low_b : low_a;
    const float(&high)[3][kWidth] = of_b ? high_b : high_a;
    const float reach = of_b ? reach_b : reach_a;
    bool meets = true;
    for (int axis = 0; axis < 3; ++axis)
      meets = meets && low[axis][l] - reach <= (of_b ? by_b : by_a).high[axis] &&
              high[axis][l] + reach >= (of_b ? by_b : by_a).low[axis];
    for (int side = 0; side < 2; ++side) {
      int total = 0;
      const bool mine = meets && of_b == (side == 1);
      const int before = team.exclusive_count(mine, total);
      if (mine) memory.left[side][left[side] + before] = static_cast<std::uint8_t>(l);
      left[side] += total;
    }
  }
  if (team.lane() == 0) memory.count[0] = left[0], memory.count[1] = left[1];
  team.sync();
  return left[0] * left[1];
}

/// Pairs of blocks of both meshes whose boxes and slabs meet: both trees are opened together.
template <class Team>
class ExactSearch {
 public:
  IST_HD ExactSearch(const Team& team, ExactMemory& memory, const ExactRoom& room)
      : team_(team), memory_(memory), room_(room) {
    if (team_.lane() == 0)
      room_.waiting[0] =
          pair_of(MeshNode::at(memory_.mesh[0].top, 0), MeshNode::at(memory_.mesh[1].top, 0));
  }

  /// How many are in the room's list now, in an order that the pair alone decides: all that are
  /// left or as many as there is room for; kNoRoom.
  IST_HD std::uint32_t next() {
    found_ = 0;
    for (; waiting_ > 0 && found_ + kWidth * kWidth <= room_.most_pairs; ++visits_) {
      team_.sync();
      if (!open(room_.waiting[waiting_ - 1])) return kNoRoom;
    }
    team_.sync();
    return found_;
  }
  IST_HD bool ended() const { return waiting_ == 0; }
  IST_HD std::uint32_t visits() const { return visits_; }  ///< pairs of nodes opened

 private:
  static constexpr float kError = 4e-7f;  ///< relative, of a few operations

  IST_HD static std::uint64_t pair_of(MeshNode a, MeshNode b) {
    return std::uint64_t{a.word} << 32 | b.word;
  }
  /// Nodes tile a surface.
  IST_HD float size_of(int side, int level) const {
    const float count = static_cast<float>(memory_.mesh[side].level[level].count);
    return (side == 0 ? 1 : static_cast<float>(memory_.place.a_from_b.scale)) / std::sqrt(count);
  }

  IST_HD bool open(std::uint64_t pair) {
    const MeshNode node[2] = {{static_cast<std::uint32_t>(pair >> 32)},
                              {static_cast<std::uint32_t>(pair)}};
    const int level[2] = {node[0].level(), node[1].level()};
    const float size[2] = {size_of(0, level[0]), size_of(1, level[1])};
    const bool opens[2] = {level[0] > 0 && (level[1] == 0 || size[1] <= kOpenedAlone * size[0]),
                           level[1] > 0 && (level[0] == 0 || size[0] <= kOpenedAlone * size[1])};
    --waiting_;
    team_.sync();
    for (int k = team_.lane(); k < 2 * static_cast<int>(kWidth); k += Team::kWidth) {
      const int side = k / static_cast<int>(kWidth);
      load(side, static_cast<std::uint32_t>(k) % kWidth, level[side], node[side].number(),
           opens[side]);
    }
    team_.sync();
    const int below[2] = {level[0] - opens[0], level[1] - opens[1]};
    const bool leaves = below[0] == 0 && below[1] == 0;
    const int pairs = narrow();
    for (int first = 0; first < pairs; first += Team::kWidth) {
      const int k = first + team_.lane();
      const int columns = memory_.count[1];
      const std::uint32_t i = k < pairs ? memory_.left[0][k / columns] : 0,
                          j = k < pairs ? memory_.left[1][k % columns] : 0;
      const bool meets = k < pairs && meet(i, j);
      int total = 0;
      const auto before = static_cast<std::uint32_t>(team_.exclusive_count(meets, total));
      if (total == 0) continue;
      std::uint32_t& count = leaves ? found_ : waiting_;
      if (count + static_cast<std::uint32_t>(total) >
          (leaves ? room_.most_pairs : room_.most_waiting))
        return false;
      if (meets)
        (leaves ? room_.pairs : room_.waiting)[count + before] =
            pair_of(child(node[0], i, opens[0]), child(node[1], j, opens[1]));
      count += static_cast<std::uint32_t>(total);
    }
    return true;
  }

  /// Lists of each side the boxes that meet the box around all of the other side; how many pairs
  /// are left.
  IST_HD int narrow() {
    const ExactBoxes &a = memory_.boxes[0], &b = memory_.boxes[1];
    return narrow_sides(team_, memory_, a.low, a.high, b.other_low, b.other_high, memory_.reach[0],
                        b.low, b.high, a.other_low, a.other_high, memory_.reach[1]);
  }

  IST_HD static MeshNode child(MeshNode of, std::uint32_t l, bool opened) {
    return opened ? MeshNode::at(of.level() - 1, kWidth * of.number() + l) : of;
  }

  /// Of a node's children the l-th, or the node alone as the first.
  IST_HD void load(int side, std::uint32_t l, int level, std::uint32_t number, bool opened) {
    const MeshTree& mesh = memory_.mesh[side];
    ExactBoxes& out = memory_.boxes[side];
    const int of_level = opened ? level - 1 : level;
    const std::uint32_t n = opened ? kWidth * number + l : number;
    if (opened ? n >= mesh.level[of_level].count : l > 0) {
      for (int k = 0; k < 3; ++k) {
        out.low[k][l] = out.other_low[k][l] = kExactFar;
        out.high[k][l] = out.other_high[k][l] = -kExactFar;
        out.normal[k][l] = out.turned[k][l] = 0;
      }
      out.slab_low[l] = out.slab_high[l] = 0;
      return;
    }
    float low[3], high[3], normal[3] = {0, 0, 0}, slab_low = -kExactFar, slab_high = kExactFar;
    if (of_level == mesh.top) {
      for (int k = 0; k < 3; ++k) low[k] = mesh.low[k], high[k] = mesh.high[k];
    } else {
      const BoxBlock& from = in_global_memory(mesh.level[of_level + 1].boxes)[n / kWidth];
      const std::uint32_t lane = n % kWidth;
      for (int k = 0; k < 3; ++k) {
        low[k] = from.low[k][lane];
        high[k] = from.high[k][lane];
        normal[k] = from.normal[k][lane];
      }
      slab_low = from.slab_low[lane], slab_high = from.slab_high[lane];
    }
    const float(&m)[12] = memory_.map[side];
    float middle[3], half[3];
    for (int k = 0; k < 3; ++k) {
      middle[k] = 0.5f * (low[k] + high[k]);
      half[k] = 0.5f * (high[k] - low[k]);
      out.low[k][l] = low[k];
      out.high[k][l] = high[k];
    }
    for (int k = 0; k < 3; ++k) {
      const float c =
          (m[3 * k] * middle[0] + m[3 * k + 1] * middle[1]) + (m[3 * k + 2] * middle[2] + m[9 + k]);
      const float h =
          (1 + kError) * ((std::abs(m[3 * k]) * half[0] + std::abs(m[3 * k + 1]) * half[1]) +
                          std::abs(m[3 * k + 2]) * half[2]) +
          memory_.pad[side];
      out.other_low[k][l] = c - h;
      out.other_high[k][l] = c + h;
    }
    // What a side of B's box, as long as 1 in its frame, reaches along a normal of A's.
    const float(&turn)[9] = memory_.turn;
    const auto scale = static_cast<float>(memory_.place.a_from_b.scale);
    if (side == 0) {
      for (int k = 0; k < 3; ++k) {
        out.normal[k][l] = normal[k];
        out.turned[k][l] =
            scale *
            (std::abs((turn[k] * normal[0] + turn[3 + k] * normal[1]) + turn[6 + k] * normal[2]) +
             kError);
      }
      out.slab_low[l] = slab_low, out.slab_high[l] = slab_high;
    } else {
      float shift = 0;
      for (int k = 0; k < 3; ++k) {
        const float turned =
            (turn[3 * k] * normal[0] + turn[3 * k + 1] * normal[1]) + turn[3 * k + 2] * normal[2];
        out.normal[k][l] = turned;
        shift += turned * memory_.map[1][9 + k];
      }
      out.slab_low[l] = scale * slab_low + shift - 2 * memory_.pad[1];
      out.slab_high[l] = scale * slab_high + shift + 2 * memory_.pad[1];
    }
  }

  IST_HD bool meet(std::uint32_t i, std::uint32_t j) const {
    const ExactBoxes &a = memory_.boxes[0], &b = memory_.boxes[1];
    bool meets = true;
    for (int k = 0; k < 3; ++k)
      meets = meets && a.low[k][i] - memory_.reach[0] <= b.other_high[k][j] &&
              a.high[k][i] + memory_.reach[0] >= b.other_low[k][j];
    if (!meets) return false;
    for (int k = 0; k < 3; ++k)
      meets = meets && b.low[k][j] - memory_.reach[1] <= a.other_high[k][i] &&
              b.high[k][j] + memory_.reach[1] >= a.other_low[k][i];
    if (!meets) return false;
    // Whether each reaches into the other's slab.
    float along = 0, reach = memory_.slack, along_b = 0, reach_b = memory_.slack;
    for (int k = 0; k < 3; ++k) {
      along += a.normal[k][i] * (0.5f * (b.other_low[k][j] + b.other_high[k][j]));
      reach += a.turned[k][i] * (0.5f * (b.high[k][j] - b.low[k][j]));
      along_b += b.normal[k][j] * (0.5f * (a.low[k][i] + a.high[k][i]));
      reach_b += std::abs(b.normal[k][j]) * (0.5f * (a.high[k][i] - a.low[k][i]));
    }
    return along - reach <= a.slab_high[i] && along + reach >= a.slab_low[i] &&
           along_b - reach_b <= b.slab_high[j] && along_b + reach_b >= b.slab_low[j];
  }

  const Team& team_;
  ExactMemory& memory_;
  const ExactRoom& room_;
  std::uint32_t waiting_ = 1, found_ = 0, visits_ = 0;
};

}  // namespace ist::gpu
