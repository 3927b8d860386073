#include "query/contact/contact_division.h"

#include <algorithm>
#include <bit>
#include <limits>

namespace ist {
namespace {

// A side of a division with less than this share of the whole contact's pull is no patch of its
// own: what comes and goes at the rim of a contact must not rename its patches.
constexpr double kLeastShare = 0.01;

// A pull that another cancels costs as much as if it acted half a radius of the solid away.
constexpr double kBend = 0.25;

// A node with fewer children than this is divided among its grandchildren: they are at most
// kMembers, and the cut finds its place.
constexpr std::uint32_t kFewChildren = 5;
constexpr std::uint32_t kMembers = 64;

std::uint64_t ones(std::uint32_t count) {
  return count < 64 ? (std::uint64_t{1} << count) - 1 : ~std::uint64_t{0};
}

bool holds(std::uint64_t members, std::uint32_t i) {
  return i < kMembers && (members >> i & 1) != 0;
}

}  // namespace

ContactDivision::ContactDivision(ContactBins& bins, std::uint32_t bin_count, double radius) noexcept
    : tree_(bins.tree()),
      bin_level_(bins.level()),
      bins_(bins.bins()),
      parts_(bins.parts()),
      order_(bins.order()),
      spare_(bins.spare()),
      bend_cost_(kBend * radius * radius) {
  if (bin_count == 0) return;
  for (std::uint32_t i = 0; i < bin_count; ++i) {
    total_pull_ += bins_[i].pull;
    order_[i] = i;
  }
  ContactPart& root = parts_[0] = ContactPart();
  root.members = 1;
  root.level = tree_.top;
  root.end = bin_count;
  root.id = id(root);
  root.loss = loss(root);
  size_ = 1;
}

void ContactDivision::run(std::size_t wanted) noexcept {
  wanted = std::min<std::size_t>(wanted, ContactBins::kBins);
  const auto less = [](const ContactPart& l, const ContactPart& r) {
    return l.loss != r.loss ? l.loss < r.loss : l.id > r.id;
  };
  while (size_ > 0 && size_ < wanted && parts_[0].loss > 0) {
    std::pop_heap(parts_, parts_ + size_, less);
    ContactPart other;
    const bool two = divide(parts_[size_ - 1], other);
    std::push_heap(parts_, parts_ + size_, less);
    if (!two) continue;
    parts_[size_++] = other;
    std::push_heap(parts_, parts_ + size_, less);
  }
  std::sort(parts_, parts_ + size_,
            [](const ContactPart& l, const ContactPart& r) { return l.id < r.id; });
}

Overlap ContactDivision::sum(const ContactPart& part) const noexcept {
  Overlap out;
  for (std::uint32_t i = part.begin; i < part.end; ++i) out.add(bin(i).sum);
  return out;
}

double ContactDivision::loss(const ContactPart& part) const {
  if (part.end - part.begin < 2) return 0;
  double pull = 0;
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  Eigen::Vector3d mean = Eigen::Vector3d::Zero();
  for (std::uint32_t i = part.begin; i < part.end; ++i) {
    pull += bin(i).pull;
    force += bin(i).sum.force;
    mean += bin(i).pull * bin(i).centre;
  }
  if (!(pull > 0)) return 0;
  mean /= pull;
  double spread = 0;
  for (std::uint32_t i = part.begin; i < part.end; ++i)
    spread += bin(i).pull * (bin(i).centre - mean).squaredNorm();
  return spread + bend_cost_ * std::max(0.0, pull - force.norm());
}

bool ContactDivision::open(ContactPart& part) const {
  const auto go_down = [&](std::uint32_t node, std::uint32_t nodes) {
    --part.level;
    part.first = kWidth * node;
    const std::uint32_t children =
        std::min(kWidth * nodes, tree_.level[part.level].count - part.first);
    part.members = ones(children);
    return children;
  };
  while (std::has_single_bit(part.members)) {
    if (part.level <= bin_level_) return false;
    const std::uint32_t children =
        go_down(part.first + static_cast<std::uint32_t>(std::countr_zero(part.members)), 1);
    if (children < kFewChildren && part.level > bin_level_) go_down(part.first, children);
  }
  return true;
}

std::uint64_t ContactDivision::cut(const ContactPart& part) const {
  struct Member {
    Eigen::Vector3d centre;
    double weight;
    std::uint64_t bit;
  };
  Member members[kMembers];
  std::uint32_t count = 0;
  double weight = 0;
  Eigen::Vector3d moment = Eigen::Vector3d::Zero();
  for (std::uint64_t left = part.members; left != 0; left &= left - 1) {
    const NodeBall ball =
        tree_.ball(part.level, part.first + static_cast<std::uint32_t>(std::countr_zero(left)));
    const double cube = ball.r * ball.r * ball.r;
    members[count++] = {{ball.centre[0], ball.centre[1], ball.centre[2]}, cube, left & -left};
    weight += cube;
    moment += cube * members[count - 1].centre;
  }

  // Along the line through two of the farthest …
  const auto farthest_from = [&](const Eigen::Vector3d& x) {
    std::uint32_t farthest = 0;
    double most = -1;
    for (std::uint32_t i = 0; i < count; ++i) {
      const double square = (members[i].centre - x).squaredNorm();
      if (!(square > most)) continue;
      most = square;
      farthest = i;
    }
    return members[farthest].centre;
  };
  const Eigen::Vector3d one_end = farthest_from(moment / weight);
  const Eigen::Vector3d axis = farthest_from(one_end) - one_end;
  struct Place {
    double along;
    std::uint32_t member;
  };
  Place places[kMembers];
  for (std::uint32_t i = 0; i < count; ++i) places[i] = {axis.dot(members[i].centre), i};
  std::sort(places, places + count, [](const Place& l, const Place& r) {
    return l.along != r.along ? l.along < r.along : l.member < r.member;
  });

  // … at the least sum of squares about both sides' means: they differ only in −|Σ w x|²/Σ w.
  double best = -std::numeric_limits<double>::infinity();
  std::uint64_t best_side = 0, side = 0;
  double near = 0;
  Eigen::Vector3d near_moment = Eigen::Vector3d::Zero();
  for (std::uint32_t i = 0; i + 1 < count; ++i) {
    const Member& member = members[places[i].member];
    side |= member.bit;
    near += member.weight;
    near_moment += member.weight * member.centre;
    const double gain =
        near_moment.squaredNorm() / near + (moment - near_moment).squaredNorm() / (weight - near);
    if (!(gain > best)) continue;
    best = gain;
    best_side = side;
  }
  return best_side != 0 ? best_side : part.members & -part.members;
}

std::uint64_t ContactDivision::id(const ContactPart& part) const {
  std::uint64_t first = ~std::uint64_t{0}, size = 0;
  for (std::uint64_t left = part.members; left != 0; left &= left - 1) {
    const std::uint64_t node = part.first + static_cast<std::uint32_t>(std::countr_zero(left));
    const std::uint64_t begin = node << (4 * part.level);
    const std::uint64_t end = (node + 1) << (4 * part.level);
    first = std::min(first, begin);
    size += std::min<std::uint64_t>(end, tree_.level[0].count) - begin;
  }
  return first << 32 | size;
}

bool ContactDivision::divide(ContactPart& part, ContactPart& other) {
  ContactPart at = part;  // goes down while all that counts lies on one side
  for (;;) {
    if (!open(at)) {
      part.loss = 0;
      return false;
    }
    const std::uint64_t side = cut(at);
    const int up = 4 * (at.level - bin_level_);
    std::uint32_t split = at.begin, others = 0;
    double pull = 0, others_pull = 0;
    for (std::uint32_t i = at.begin; i < at.end; ++i) {
      const bool on_side = holds(side, (bin(i).node >> up) - at.first);
      (on_side ? pull : others_pull) += bin(i).pull;
      if (on_side) {
        order_[split++] = order_[i];
      } else {
        spare_[others++] = order_[i];
      }
    }
    std::copy(spare_, spare_ + others, order_ + split);
    const double least = kLeastShare * total_pull_;
    if (others == 0 || others_pull < least) {
      at.members = side;
    } else if (split == at.begin || pull < least) {
      at.members &= ~side;
    } else {
      part = other = at;
      part.members = side;
      part.end = split;
      other.members &= ~side;
      other.begin = split;
      for (ContactPart* half : {&part, &other}) {
        half->id = id(*half);
        half->loss = loss(*half);
      }
      return true;
    }
  }
}

}  // namespace ist
