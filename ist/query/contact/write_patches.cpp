#include "query/contact/write_patches.h"

#include <algorithm>

namespace ist {
namespace {

/// Divides a contact along the tree of one of its solids. The cuts, and thus a patch's identity,
/// depend on the tree alone; the pose decides which regions are worth a patch.
class ContactDivision {
 public:
  /// `radius`: of the tree's root, in the frame of the bins.
  ContactDivision(ContactBins& bins, std::uint32_t bin_count, double radius) noexcept
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

  /// Divides until there are `wanted` parts or none is worth it; sorts by place in the tree.
  void run(std::size_t wanted) noexcept {
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

  std::size_t size() const noexcept { return size_; }

  Overlap sum(const ContactPart& part) const noexcept {
    Overlap out;
    for (std::uint32_t i = part.begin; i < part.end; ++i) out.add(bin(i).sum);
    return out;
  }

 private:
  const ContactBin& bin(std::uint32_t i) const { return bins_[order_[i]]; }

  /// The error of replacing the part by one force at one point: the spread of its points of attack,
  /// and the pull that cancels. It never exceeds the loss of a part that contains this one.
  double loss(const ContactPart& part) const {
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

  /// Divides `part` into itself and `other`; false if it has one member.
  bool divide(ContactPart& part, ContactPart& other) {
    ContactPart at = part;  // descends while only one side counts
    while (cuts_.open(at.region)) {
      const std::uint64_t side = cuts_.cut(at.region);
      const int up = 4 * (at.region.level - cuts_.bin_level());
      std::uint32_t split = at.begin, others = 0;
      double pull = 0, others_pull = 0;
      for (std::uint32_t i = at.begin; i < at.end; ++i) {
        const bool on_side = TreeCuts::has_member(side, (bin(i).node >> up) - at.region.first);
        (on_side ? pull : others_pull) += bin(i).pull;
        (on_side ? order_[split++] : spare_[others++]) = order_[i];
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
    part.loss = 0;
    return false;
  }

  const TreeCuts cuts_;
  const ContactBin* const bins_;
  ContactPart* const parts_;
  std::uint32_t* const order_;
  std::uint32_t* const spare_;
  const double bend_cost_;  ///< of a unit of pull that cancels
  double total_pull_ = 0;
  std::size_t size_ = 0;
};

/// Corrects the largest patch so that the patches' members sum to `whole`, except for the last
/// digit.
template <class T>
void complete(std::span<ContactPatch> patches, std::size_t largest, const T& whole,
              T ContactPatch::*member) {
  for (int round = 0; round < 2; ++round) {
    T missing = whole;
    for (ContactPatch& patch : patches) missing -= patch.*member;
    patches[largest].*member += missing;
  }
}

}  // namespace

std::size_t write_patches(const Binned& binned, const Penetration& whole,
                          std::span<ContactPatch> patches) noexcept {
  if (patches.empty()) return 0;
  ContactDivision division(binned.bins, binned.filled, binned.radius);
  division.run(patches.size());
  if (division.size() == 0) return 0;
  const std::span<ContactPatch> out = patches.first(division.size());

  double volume = 0;
  std::size_t largest = 0;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const ContactPart& part = binned.bins.parts()[i];
    Overlap pushed = division.sum(part);
    pushed.force = -pushed.force;  // on B
    pushed.torque = -pushed.torque;
    const WorldSums sum = pushed.in_world(binned.pose);
    ContactPatch& patch = out[i];
    patch = ContactPatch();
    patch.id = part.id;
    patch.volume = sum.volume;
    patch.centroid = sum.volume > 0 ? vector(sum.centroid) : whole.centroid;
    patch.force = vector(sum.translation_gradient);
    patch.torque = vector(sum.rotation_gradient);
    volume += patch.volume;
    if (patch.volume > out[largest].volume) largest = i;
  }

  // `whole` is summed in another order, and clamped to its bounds.
  const double factor = volume > 0 ? whole.volume / volume : 0;
  for (ContactPatch& patch : out) {
    patch.volume *= factor;
    if (whole.status == QueryStatus::ok) continue;
    patch.force *= factor;
    patch.torque *= factor;
  }
  complete(out, largest, whole.volume, &ContactPatch::volume);
  complete(out, largest, whole.force, &ContactPatch::force);
  complete(out, largest, whole.torque, &ContactPatch::torque);
  return out.size();
}

std::size_t spread(const Penetration& part, const Penetration& whole, std::size_t count,
                   std::span<ContactPatch> patches) noexcept {
  if (patches.empty() || !(whole.volume > 0)) return 0;
  if (count == 0 || !(part.volume > 0)) {
    patches[0] = ContactPatch();
    patches[0].centroid = whole.centroid;
    patches[0].volume = whole.volume;
    patches[0].force = whole.force;
    patches[0].torque = whole.torque;
    return 1;
  }
  const double factor = whole.volume / part.volume;
  for (ContactPatch& patch : patches.first(count)) {
    const double share = patch.volume / part.volume;
    patch.force += share * (whole.force - part.force);
    patch.torque += share * (whole.torque - part.torque);
    patch.volume *= factor;
  }
  return count;
}

void finish_patches(std::span<ContactPatch> patches, const Pose& b, double deepest) noexcept {
  for (ContactPatch& patch : patches) {
    const PatchAxis axis = PatchAxis::of(patch.volume, plain(patch.centroid), plain(patch.force),
                                         plain(patch.torque), vec3(b.t), deepest);
    patch.point = vector(axis.point);
    patch.normal = vector(axis.normal);
    patch.area = axis.area;
    patch.depth = axis.depth;
    patch.torsion = axis.torsion;
  }
}

}  // namespace ist
