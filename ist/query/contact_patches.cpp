#include <Eigen/Geometry>
#include <algorithm>

#include <ist/query.h>

#include "query/asset/sphere_tree.h"
#include "query/contact/contact_bins.h"
#include "query/contact/contact_division.h"
#include "query/descent/descent.h"
#include "query/descent/workspace.h"

namespace ist {
namespace {

// Solids of fewer leaf blocks than this are too coarse to be divided, if the other is finer.
constexpr std::uint32_t kFewBlocks = 16;

/// Whether contacts are divided along B's tree: the smaller solid's, whose contacts stay with its
/// own corners while it slides, or the only one fine enough. The pose has no say.
bool divides_b(const SphereTree& a, double radius_a, const SphereTree& b, double radius_b) {
  const std::uint32_t blocks_a = a.level[0].count;
  const std::uint32_t blocks_b = b.level[0].count;
  const std::uint32_t fewer = std::min(blocks_a, blocks_b);
  if (fewer < kFewBlocks && blocks_a != blocks_b) return blocks_b > blocks_a;
  return radius_b <= radius_a;
}

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

ContactPatches contact_patches(const PlacedTree& a, const PlacedTree& b,
                               const ContactSettings& settings, Workspace& workspace,
                               std::span<ContactPatch> patches) noexcept {
  ContactPatches result;
  const std::optional<RelativePose> pose = relative_pose(a, b);
  if (!pose || workspace.impl() == nullptr) {
    result.penetration.status = QueryStatus::invalid_input;
    return result;
  }
  const SphereTree tree_a = sphere_tree(a.tree, settings.measure);
  const SphereTree tree_b = sphere_tree(b.tree, settings.measure);
  const double radius_a = tree_a.header->root[3];
  const double radius_b = tree_b.header->root[3] * pose->a_from_b.scale;
  ContactBins& bins = workspace.impl()->contact;
  const bool of_b = divides_b(tree_a, radius_a, tree_b, radius_b);
  bins.start(of_b ? tree_b : tree_a, of_b);
  Descent descent(tree_a, tree_b, *pose, limits_of(settings), *workspace.impl(), &bins);
  descent.run();
  result.penetration = descent.penetration();
  const Penetration& whole = result.penetration;

  if (patches.empty()) return result;
  ContactDivision division(bins, bins.collect(descent.precision()), of_b ? radius_b : radius_a);
  division.run(patches.size());
  result.count = division.size();
  if (result.count == 0) return result;
  const std::span<ContactPatch> out = patches.first(result.count);

  const double unit = pose->unit_a;
  const Eigen::Vector3d origin_b(pose->a_from_b.t[0], pose->a_from_b.t[1], pose->a_from_b.t[2]);
  double volume = 0;
  std::size_t largest = 0;
  for (std::size_t i = 0; i < out.size(); ++i) {
    const ContactPart& part = bins.parts()[i];
    const Overlap sum = division.sum(part);
    ContactPatch& patch = out[i];
    patch = ContactPatch();
    patch.id = part.id;
    patch.volume = unit * unit * unit * sum.volume;
    patch.centroid = sum.volume > 0 ? pose->to_world(sum.moment / sum.volume + origin_b)
                                    : Eigen::Vector3d(whole.centroid);
    patch.force = -(unit * unit) * (pose->rotation_a * sum.force);
    patch.torque = -(unit * unit * unit) * (pose->rotation_a * sum.torque) +
                   pose->unit_offset_b.cross(patch.force);
    volume += patch.volume;
    if (patch.volume > out[largest].volume) largest = i;
  }

  // The whole is summed in another order, and bounded.
  for (ContactPatch& patch : out) patch.volume *= volume > 0 ? whole.volume / volume : 0;
  complete(out, largest, whole.volume, [](ContactPatch& p) -> double& { return p.volume; });
  complete<Eigen::Vector3d>(out, largest, -whole.translation_gradient,
                            [](ContactPatch& p) -> Eigen::Vector3d& { return p.force; });
  complete<Eigen::Vector3d>(out, largest, -whole.rotation_gradient,
                            [](ContactPatch& p) -> Eigen::Vector3d& { return p.torque; });
  const double deepest = 2 * unit * std::min(radius_a, radius_b);
  for (ContactPatch& patch : out) {
    patch.area = patch.force.norm();
    if (!(patch.area > 0)) continue;
    patch.normal = patch.force / patch.area;
    patch.depth = std::min(patch.volume / patch.area, deepest);
  }
  return result;
}

}  // namespace ist
