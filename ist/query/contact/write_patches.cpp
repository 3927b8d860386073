#include "query/contact/write_patches.h"

#include "query/contact/contact_division.h"

namespace ist {
namespace {

/// Adds what is missing to the sum of `value(patch)` over the patches to the largest of them, so
/// that the shares give `whole` but for the last digit.
template <class T, class Value>
void complete(std::span<ContactPatch> patches, std::size_t largest, const T& whole, Value value) {
  for (int round = 0; round < 2; ++round) {
    T missing = whole;
    for (ContactPatch& patch : patches) missing -= value(patch);
    value(patches[largest]) += missing;
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

  // The whole is summed in another order, and bounded.
  const double factor = volume > 0 ? whole.volume / volume : 0;
  for (ContactPatch& patch : out) {
    patch.volume *= factor;
    if (whole.status == QueryStatus::ok) continue;
    patch.force *= factor;
    patch.torque *= factor;
  }
  complete(out, largest, whole.volume, [](ContactPatch& p) -> double& { return p.volume; });
  complete<Eigen::Vector3d>(out, largest, whole.force,
                            [](ContactPatch& p) -> Eigen::Vector3d& { return p.force; });
  complete<Eigen::Vector3d>(out, largest, whole.torque,
                            [](ContactPatch& p) -> Eigen::Vector3d& { return p.torque; });
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
