#include "query/contact/contact_division.h"

#include <algorithm>

namespace ist {

ContactDivision::ContactDivision(ContactBins& bins, std::uint32_t bin_count, double radius) noexcept
    : cuts_(bins.tree()),
      bins_(bins.bins()),
      parts_(bins.parts()),
      order_(bins.order()),
      spare_(bins.spare()),
      bend_cost_(kContactBend * radius * radius) {
  if (bin_count == 0) return;
  for (std::uint32_t i = 0; i < bin_count; ++i) {
    total_pull_ += bins_[i].pull;
    order_[i] = i;
  }
  ContactPart& root = parts_[0] = ContactPart();
  root.region = cuts_.root();
  root.end = bin_count;
  root.id = cuts_.id(root.region);
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

bool ContactDivision::divide(ContactPart& part, ContactPart& other) {
  ContactPart at = part;  // goes down while all that counts lies on one side
  for (;;) {
    if (!cuts_.open(at.region)) {
      part.loss = 0;
      return false;
    }
    const std::uint64_t side = cuts_.cut(at.region);
    const int up = 4 * (at.region.level - cuts_.bin_level());
    std::uint32_t split = at.begin, others = 0;
    double pull = 0, others_pull = 0;
    for (std::uint32_t i = at.begin; i < at.end; ++i) {
      const bool on_side = TreeCuts::holds(side, (bin(i).node >> up) - at.region.first);
      (on_side ? pull : others_pull) += bin(i).pull;
      if (on_side) {
        order_[split++] = order_[i];
      } else {
        spare_[others++] = order_[i];
      }
    }
    std::copy(spare_, spare_ + others, order_ + split);
    const double least = kLeastContactShare * total_pull_;
    if (others == 0 || others_pull < least) {
      at.region.members = side;
    } else if (split == at.begin || pull < least) {
      at.region.members &= ~side;
    } else {
      part = other = at;
      part.region.members = side;
      part.end = split;
      other.region.members &= ~side;
      other.begin = split;
      for (ContactPart* half : {&part, &other}) {
        half->id = cuts_.id(half->region);
        half->loss = loss(*half);
      }
      return true;
    }
  }
}

}  // namespace ist
