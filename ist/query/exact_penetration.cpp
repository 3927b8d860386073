#include <Eigen/Geometry>
#include <algorithm>
#include <cstdint>
#include <cstring>
#include <utility>

#include "query/base/no_answer.h"
#include "query/base/solid_bounds.h"
#include "query/contact/write_patches.h"
#include "query/exact/exact_overlap.h"
#include "query/exact/exact_sums.h"
#include "query/exact/keep_largest.h"
#include "query/exact/kept_mesh.h"
#include "query/exact/mesh_box.h"
#include "query/exact/overlap_octants.h"
#include "query/exact/overlap_terms.h"
#include "query/scratch/workspace.h"
#include "query/solid_queries.h"

namespace ist {
namespace {

/// The result of ExactQuery::run() in the form that OverlapParts uses.
class MeshOverlap : public ExactQuery {
 public:
  using ExactQuery::ExactQuery;

 protected:
  static constexpr bool leads() noexcept { return true; }
  static constexpr std::uint32_t lane() noexcept { return 0; }
  static constexpr std::uint32_t width() noexcept { return 1; }
  static void meet() noexcept {}
  static bool any(bool flag) noexcept { return flag; }
  static int exclusive_count(bool flag, int& total) noexcept {
    total = flag ? 1 : 0;
    return 0;
  }
  template <class T>
  static T load(const T& at) noexcept {
    return at;
  }
  static void store(std::uint32_t& at, std::uint32_t to) noexcept { at = to; }
  static std::uint32_t add(std::uint32_t& at, std::uint32_t by) noexcept {
    return std::exchange(at, at + by);
  }
  static std::uint32_t exchange(std::uint32_t& at, std::uint32_t to) noexcept {
    return std::exchange(at, to);
  }
  static void least(double& at, double x) noexcept { at = x < at ? x : at; }
  static void most(double& at, double x) noexcept { at = x > at ? x : at; }
  template <class T>
  static T replace(T& at, T from, T to) noexcept {
    const T before = at;
    if (before == from) at = to;
    return before;
  }

  const MeshTree& mesh(int side) const noexcept { return sides_[side].mesh; }
  const PartMemory& memory() const noexcept { return memory_; }
  PieceMemory& pieces() noexcept { return scratch_.pieces; }
  const ExactSums& whole() const noexcept { return out_.sums; }
  const exact::Point& origin() const noexcept { return out_.origin; }
  const Similarity& map() const noexcept { return a_from_b_; }

  std::uint32_t crossings() const noexcept { return out_.crossings; }
  std::uint32_t triangle(int side, std::uint32_t i) const noexcept {
    return scratch_.crossings.triangle(side, i);
  }
  CrossingEnd end_of(std::uint32_t i, int e) const noexcept {
    return scratch_.crossings.end_of(i, e);
  }
  double share_of_edge(std::uint32_t i, int e) const noexcept {
    return scratch_.crossings.end(e, Crossings::kT)[i];
  }
  exact::Point place_of(std::uint32_t i, int e) const noexcept {
    return scratch_.crossings.place_of(i, e, out_.origin);
  }

  std::uint32_t first_record(int side) const noexcept {
    return side == 0 ? 0 : sides_[0].marks.count;
  }
  std::uint32_t end_record(int side) const noexcept {
    return first_record(side) + sides_[side].marks.count;
  }
  int side_of(std::uint32_t r) const noexcept { return r < sides_[0].marks.count ? 0 : 1; }
  std::uint32_t record_of(int side, std::uint32_t block) const noexcept {
    return first_record(side) + sides_[side].marks.place[block];
  }
  const CrossedBlock& crossed(std::uint32_t r) const noexcept {
    const int side = side_of(r);
    return sides_[side].marks.blocks[r - first_record(side)];
  }
  std::uint32_t number_of(std::uint32_t r) const noexcept { return crossed(r).block; }
  std::uint32_t inside_of(std::uint32_t r) const noexcept { return crossed(r).inside; }
  std::uint64_t pierced_of(std::uint32_t r) const noexcept { return crossed(r).pierced; }
  std::uint32_t opposite_edge(std::uint32_t r, std::uint32_t t) const noexcept {
    return ExactQuery::opposite_edge(crossed(r), t);
  }
  exact::Point at(std::uint32_t r, std::uint32_t v) const noexcept { return crossed(r).at(v); }
  int whole_of(std::uint32_t r, std::uint32_t t) const noexcept {
    return middle_of(mesh(side_of(r)).blocks[number_of(r)], crossed(r),
                     3 * t + opposite_edge(r, t));
  }

  bool is_inside(int side, std::uint32_t b) const noexcept {
    return has(sides_[side].marks.inside, b);
  }
  bool is_pierced(int side, std::uint32_t b) const noexcept {
    return has(sides_[side].marks.pierced, b);
  }
  template <class Visit>
  void for_each_inside(int side, const Visit& visit) const {
    for_each_block(sides_[side].marks.inside, mesh(side).level[0].count, visit);
  }
  template <class Visit>
  void for_each_pierced(int side, const Visit& visit) const {
    for_each_block(sides_[side].marks.pierced, mesh(side).level[0].count, visit);
  }

  exact::Point vertex(int side, std::uint32_t number) const noexcept {
    return place(sides_[side], number) - out_.origin;
  }
  LaneSums lane_sums(int side, std::uint32_t b, const exact::Point& from) const noexcept {
    return ExactQuery::lane_sums(sides_[side], 1, b / kWidth, b % kWidth, out_.origin + from);
  }

  void find_crossing_terms(std::uint32_t first) noexcept {
    crossing_terms(scratch_.crossings, first, out_.origin, pieces().terms);
  }
  void count_triangles(std::uint32_t r) noexcept {
    ExactQuery::count_triangles(mesh(side_of(r)).blocks[number_of(r)], crossed(r), pieces().whole);
  }
  void find_triangle_terms(std::uint32_t r, std::uint32_t h) noexcept {
    triangle_terms(crossed(r), pieces().whole, static_cast<int>(h), pieces().terms);
  }
  void find_octant_pieces(std::uint32_t first) noexcept {
    octant_pieces(scratch_.crossings, first, pieces().view, pieces().octants);
  }

 private:
  PartMemory memory_ = scratch_.part_memory();
};

class ExactParts : public OverlapOctants<MeshOverlap> {
 public:
  using OverlapOctants::OverlapOctants;

  /// Divides the result of run(): OverlapParts::divide(). A kept pair knows whether all is one
  /// part.
  std::uint32_t divide() noexcept;

  /// The ends of crossing i relative to the origin, A's unit frame.
  void segment(std::uint32_t i, exact::Point& from, exact::Point& to) const noexcept {
    from = place_of(i, 0);
    to = place_of(i, 1);
  }

 private:
  std::uint64_t hash_of_names() const noexcept;
};

/// A hash of the names of crossings and their ends, in order, and of what is inside. These
/// determine what is connected, unless an edge is pierced more than twice or a curve is in one
/// triangle.
std::uint64_t ExactParts::hash_of_names() const noexcept {
  std::uint64_t hash = out_.crossings;
  const auto mix = [&](std::uint64_t name) {
    hash = (hash ^ name) * 0x9e3779b97f4a7c15u;
    hash ^= hash >> 32;
  };
  const Crossings& crossings = scratch_.crossings;
  for (std::uint32_t i = 0; i < out_.crossings; ++i) {
    const auto edge = [&](int e) {
      return static_cast<std::uint64_t>(static_cast<int>(crossings.end(e, Crossings::kEdge)[i]));
    };
    mix(std::uint64_t{crossings.triangle(0, i)} << (kTriangleBits + 8) |
        std::uint64_t{crossings.triangle(1, i)} << 8 | edge(0) << 4 | edge(1));
  }
  for (const Side& own : sides_) {
    for (std::uint32_t c = 0; c < own.marks.count; ++c) {
      const CrossedBlock& crossed = own.marks.blocks[c];
      std::uint64_t apexes[2];
      std::memcpy(apexes, crossed.apex, sizeof apexes);
      for (const std::uint64_t name : {std::uint64_t{crossed.inside}, apexes[0], apexes[1]})
        mix(name);
    }
    for (std::uint32_t w = 0; w < (own.mesh.level[0].count + 63) / 64; ++w)
      mix(own.marks.inside[w]);
  }
  return std::max(hash, std::uint64_t{1});
}

std::uint32_t ExactParts::divide() noexcept {
  if (kept_ == nullptr) return OverlapParts::divide();
  const std::uint64_t names = hash_of_names();
  const bool known = kept_->one == names;
  start(known);
  if (!known) join();
  name_parts();
  if (!known) {
    one_ = are_one();
    kept_->one = one_ && by_names_ ? names : 0;
  }
  return finish();
}

/// Two meshes and how far their surfaces are from their true places relative to each other, A's
/// unit frame.
struct PlacedMeshes {
  MeshTree a, b;
  double moved_a, moved_b;

  PlacedMeshes(const PlacedAsset& from_a, const PlacedAsset& from_b, const RelativePose& pose)
      : a(mesh_of(from_a)),
        b(mesh_of(from_b)),
        moved_a(moved_in_mesh(a)),
        moved_b(moved_by_poses(from_a, from_b, b, pose) + pose.a_from_b.scale * moved_in_mesh(b)) {}

  /// True if boxes show that there is nothing to search for.
  bool apart(const PlacedAsset& from_a, const PlacedAsset& from_b,
             const RelativePose& pose) const noexcept {
    return boxes_apart(MeshBox::of(from_a.asset.header()), MeshBox::of(from_b.asset.header()), pose,
                       touching_distance(moved_a + moved_b, a, b, pose.a_from_b));
  }
  template <class Query>
  Query query(const RelativePose& pose, ExactScratch& scratch) const {
    return {a, moved_a, b, moved_b, pose.a_from_b, pose.b_from_a, scratch};
  }
};

ExactInWorld in_world(const ExactSums& sums, const exact::Point& origin, const PairPlace& place) {
  return {sums.volume(), sums.moment, sums.force, sums.torque, origin, place};
}

Penetration whole_answer(const ExactOverlap& found, const PlacedAsset& a, const PlacedAsset& b,
                         const RelativePose& pose) {
  const ExactInWorld sums = in_world(found.sums, found.origin, pose);
  Penetration answer;
  answer.volume = std::max(0.0, sums.volume);
  const double error = found.error * pose.unit3() + (answer.volume - sums.volume);
  answer.volume_min = std::max(0.0, answer.volume - error);
  answer.volume_max = answer.volume + error;
  // No overlap is larger than the smaller solid.
  const double most = smaller_volume(a, b);
  for (double* const volume : {&answer.volume, &answer.volume_min, &answer.volume_max})
    *volume = std::min(*volume, most);
  if (answer.volume > 0) answer.centroid = vector(sums.centroid);
  if (found.contact.area > 0)
    answer.centroid = pose.to_world(1 / found.contact.area * vector(found.contact.moment));
  answer.force = -vector(sums.force);
  answer.torque = -vector(sums.torque);
  answer.touching = found.contact.touching;
  answer.contact_area = found.contact.area * (pose.unit_a * pose.unit_a);
  // Normals that cancel leave the rounding of areas.
  const Eigen::Vector3d normal = vector(found.contact.normal);
  if (normal.norm() > 1e-9 * found.contact.area)
    answer.contact_normal = pose.rotation() * normal.normalized();
  answer.node_visits = found.visits;
  answer.sphere_pairs = found.crossings;
  return answer;
}

/// The settings for the spheres' answer, which replaces an exact answer that a limit stopped.
template <class Settings>
Settings settings_of_spheres(Settings settings) {
  settings.measure = Measure::matched;
  settings.spheres_only = true;
  settings.relative_error = 0;
  return settings;
}

Penetration stopped(const PlacedAsset& a, const PlacedAsset& b, Penetration by_spheres) {
  bound_by_solids(a, b, by_spheres);
  by_spheres.status = QueryStatus::budget_exhausted;
  return by_spheres;
}

/// Writes the kept parts in their order; `kept` becomes the patch's index.
std::size_t write_parts(std::span<ExactPart> parts, const exact::Point& origin,
                        const RelativePose& pose, std::span<ContactPatch> patches) {
  std::uint32_t count = 0;
  for (std::uint32_t p = 0; p < parts.size(); ++p) {
    if (parts[p].kept != p) continue;
    const ExactInWorld sums = in_world(parts[p].sums, origin, pose);
    ContactPatch& patch = patches[parts[p].listed = count++];
    patch = {};
    patch.id = parts[p].id;
    patch.centroid = vector(sums.centroid);
    patch.volume = sums.volume;
    patch.force = -vector(sums.force);
    patch.torque = -vector(sums.torque);
  }
  for (ExactPart& part : parts) part.kept = parts[part.kept].listed;
  return count;
}

}  // namespace

Penetration exact_penetration(const PlacedAsset& a, const PlacedAsset& b,
                              const PenetrationSettings& settings, const RelativePose& pose,
                              Workspace& workspace) noexcept {
  if (a.asset.header().mesh == 0 || b.asset.header().mesh == 0) return missing_data<Penetration>();
  const PlacedMeshes meshes(a, b, pose);
  if (meshes.apart(a, b, pose)) return whole_answer({}, a, b, pose);
  auto query = meshes.query<ExactQuery>(pose, workspace.impl()->exact);
  const ExactOverlap found = query.run(settings.max_visits, settings.pair_id);
  if (found.complete) return whole_answer(found, a, b, pose);
  return stopped(a, b,
                 lack_spheres(a, b) ? missing_data<Penetration>()
                                    : penetration(a, b, settings_of_spheres(settings), workspace));
}

OverlapOutline exact_patches(const PlacedAsset& a, const PlacedAsset& b,
                             const ContactSettings& settings, Workspace& workspace,
                             std::span<ContactPatch> patches, std::span<OutlineSegment> segments,
                             bool divides) noexcept {
  const std::optional<RelativePose> pose = relative_pose(a, b);
  if (!pose || workspace.impl() == nullptr) return invalid_input<OverlapOutline>();
  if (a.asset.header().mesh == 0 || b.asset.header().mesh == 0)
    return missing_data<OverlapOutline>();
  OverlapOutline answer;
  const PlacedMeshes meshes(a, b, *pose);
  if (meshes.apart(a, b, *pose)) {
    answer.contact.penetration = whole_answer({}, a, b, *pose);
    return answer;
  }
  ExactScratch& scratch = workspace.impl()->exact;
  auto query = meshes.query<ExactParts>(*pose, scratch);
  const ExactOverlap found = query.run(settings.max_visits, settings.pair_id);
  if (!found.complete || !query.holds_crossings()) {
    answer.contact = lack_spheres(a, b)
                         ? missing_data<ContactPatches>()
                         : find_patches(a, b, settings_of_spheres(settings), workspace, patches);
    answer.contact.penetration = stopped(a, b, answer.contact.penetration);
    return answer;
  }
  answer.contact.penetration = whole_answer(found, a, b, *pose);
  answer.segments = found.crossings;
  if (!patches.empty()) {
    std::span<ExactPart> parts(scratch.parts.get(), query.divide());
    const auto capacity = static_cast<std::uint32_t>(std::min<std::size_t>(patches.size(), ~0u));
    const auto keep = [&](bool octants) {
      return keep_largest(parts.data(), static_cast<std::uint32_t>(parts.size()), capacity,
                          octants);
    };
    const std::uint32_t kept = keep(false);
    if (divides && kept <= PartMemory::kMostSplit && capacity > 1) {
      join_parts(parts.data(), static_cast<std::uint32_t>(parts.size()));
      const bool by_b = volume_of(b) <= volume_of(a);
      const PlacedAsset& smaller = by_b ? b : a;
      const double radius = smaller.scale * smaller.asset.header().ball_radius / pose->unit_a;
      parts = {scratch.octants.get(), query.split(static_cast<std::uint32_t>(parts.size()), by_b,
                                                  kNearOctants * radius, capacity)};
      keep(true);
    } else if (divides) {
      for (ExactPart& part : parts) part.id *= 8;
    }
    join_parts(parts.data(), static_cast<std::uint32_t>(parts.size()));
    answer.contact.count = write_parts(parts, found.origin, *pose, patches);
    finish_patches(patches.first(answer.contact.count), b.pose,
                   exact_deepest(answer.contact.penetration.volume));
  }
  const auto to_world = [&](const exact::Point& p) {
    return pose->to_world(vector(found.origin) + vector(p));
  };
  for (std::uint32_t i = 0; i < std::min<std::size_t>(segments.size(), found.crossings); ++i) {
    exact::Point from, to;
    query.segment(i, from, to);
    const std::uint32_t patch = patches.empty() ? 0 : query.part_of_crossing(i);
    segments[i] = {to_world(from), to_world(to), patch};
  }
  return answer;
}

}  // namespace ist
