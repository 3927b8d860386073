#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>

#include <ist/api.h>
#include <ist/pose.h>
#include <ist/query_enums.h>
#include <ist/tree_view.h>

namespace IST_API ist {

/// What a penetration may cost. Zero, a negative value or NaN means no limit; with none set the
/// answer is the finished sum.
///
/// A penetration that is stopped estimates what is left, by what it summed under a deadline and
/// else from the densities of the nodes that were not opened, and says budget_exhausted.
///
/// Measure::exact heeds max_visits alone. One that is stopped answers what the matched spheres do
/// (NaN where an asset has none), says budget_exhausted, and bounds the true volume by 0 and the
/// smaller solid's.
struct PenetrationSettings {
  Measure measure = Measure::matched;
  FieldUse field = FieldUse::automatic;  ///< matched measure only

  /// Count of sphere pairs to spend; matched measure only (the inner one has no levels of detail).
  ///
  /// The answer comes from the finest level of detail that is expected to need no more.
  /// From 0.7 of the budget on it is blended with the next coarser level: volume and force stay
  /// continuous, gradients are the blended sum's.
  /// Shallow contacts keep all spheres.
  /// Aimed at, not kept; never less than the coarsest level takes.
  std::uint32_t pair_budget = 0;

  /// Count of node pairs opened. Of pairs of trees the largest bounds go first; what meets a
  /// surface goes in the order of the tree.
  std::uint32_t max_visits = 0;

  /// [µs] wall clock from the call.
  /// Of pairs of trees as many sixteenths of the leaves are summed as there is time for, the same
  /// ones at every pose, and stand for all: volume and force then change smoothly with the pose,
  /// and a loop gains little energy where six or more are. If not even one can be summed, or a
  /// surface is met, visits end at 0.6 to 0.75 of the time and what is left is estimated. Kept to a
  /// few µs while the system lets the thread run; what the system takes is not counted.
  double deadline_us = 0;

  double relative_error = 0;  ///< stop once (volume_max − volume_min) ≤ this · volume_max
  double min_radius = 0;      ///< [u] nodes smaller than this are not opened
};

/// What contact patches may cost; each limit as in PenetrationSettings.
struct ContactSettings {
  Measure measure = Measure::matched;
  FieldUse field = FieldUse::automatic;  ///< matched measure only
  std::uint32_t max_visits = 0;  ///< count of node pairs opened; the largest bounds go first
  /// [µs] wall clock from the call, as in PenetrationSettings. Where nothing can stand for all, all
  /// that is left when visits end is estimated, at 0.1 µs a pair.
  double deadline_us = 0;
  double relative_error = 0;  ///< stop once (volume_max − volume_min) ≤ this · volume_max
  double min_radius = 0;      ///< [u] nodes smaller than this are not opened
};

/// What a separation may cost. Zero, a negative value or NaN means no limit.
struct SeparationSettings {
  std::uint32_t max_visits = 0;  ///< count of node pairs opened, the nearest first
  double deadline_us = 0;        ///< [µs] wall clock from the call; visits end at 0.95 of it
};

/// What each half of query() may cost.
struct QuerySettings {
  PenetrationSettings penetration;
  SeparationSettings separation;
};

/// A tree at a pose, under an optional uniform scale: x_world = R (scale · x) + t.
struct PlacedTree {
  TreeView tree;
  Pose pose;
  double scale = 1;  ///< > 0, about the object's own origin, before the pose
};

/// Overlap of two placed solids. Gradients are taken with respect to a motion of B, A held still.
struct Penetration {
  double volume = 0;  ///< [u³] in the chosen measure
  /// [u³] By Measure::exact these are bounds: the true volume is at least volume_min and at most
  /// volume_max. By spheres they hold the finished sum, with its rounding, and say nothing of how
  /// near that sum is to the true volume.
  double volume_min = 0;
  double volume_max = 0;
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();  ///< [u] of the overlap, world; zero if none
  /// [u²] dV/d(translation of B), world. A pressure [force/u²] pushes B by −pressure times this, A
  /// by the opposite: <ist/response.h> has pressures that grow with depth.
  Eigen::Vector3d translation_gradient = Eigen::Vector3d::Zero();
  /// [u³/rad] dV/d(rotation vector of B about B's origin), world.
  Eigen::Vector3d rotation_gradient = Eigen::Vector3d::Zero();
  QueryStatus status = QueryStatus::ok;
  std::uint32_t node_visits = 0;  ///< node pairs opened
  /// Lenses summed that are not empty, spheres put together with triangles of a surface, and
  /// spheres that lie in the other solid as a whole. By Measure::exact: triangles that cross.
  std::uint32_t sphere_pairs = 0;
};

/// Gap of two placed solids; all zero once inner spheres overlap.
struct Separation {
  double distance = 0;      ///< [u] between the inner spheres
  double distance_min = 0;  ///< [u] the true distance of the solids is at least this, certified
  double distance_max = 0;  ///< [u] and at most this, certified
  Eigen::Vector3d point_a = Eigen::Vector3d::Zero();  ///< [u] on A's inner spheres, world
  Eigen::Vector3d point_b = Eigen::Vector3d::Zero();  ///< [u] on B's inner spheres, world
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();   ///< unit, from A to B, world
  QueryStatus status = QueryStatus::ok;
  std::uint32_t node_visits = 0;   ///< node pairs opened
  std::uint32_t sphere_pairs = 0;  ///< sphere pairs measured
};

/// Where a workspace takes its memory: plain functions, called while it is made and when it ends.
struct MemoryHooks {
  /// At least `bytes` bytes at a multiple of `alignment`, a power of two, or null if there are
  /// none. Null here: operator new.
  void* (*allocate)(void* context, std::size_t bytes, std::size_t alignment) = nullptr;
  void (*release)(void* context, void* memory, std::size_t bytes, std::size_t alignment) = nullptr;
  void* context = nullptr;  ///< handed to both
};

/// Scratch memory of a query: make one a thread, once.
///
/// It never changes an answer.
/// A query that needs more than its capacity stops with budget_exhausted.
class Workspace {
 public:
  /// `capacity`: count of node pairs that may wait at once. The default serves two trees of 64,000
  /// spheres at any pose. Takes 40 bytes each, in pages that are touched as they are needed.
  ///
  /// Throws std::bad_alloc.
  explicit Workspace(std::size_t capacity = 1u << 20, const MemoryHooks& memory = {});
  ~Workspace();
  Workspace(Workspace&&) noexcept;
  Workspace& operator=(Workspace&&) noexcept;

  struct Impl;
  Impl* impl() noexcept { return impl_.get(); }  ///< null once moved from

 private:
  struct Release {
    void operator()(Impl* impl) const noexcept;
  };
  std::unique_ptr<Impl, Release> impl_;
};

/// Volume, wrench and centroid of the overlap.
///
/// By spheres the sum is Σ over spheres of the finer tree of their exact part inside the other's
/// surface, or one of lenses, as PenetrationSettings::field says. The gradients of a finished query
/// are those of the returned volume. Copies of one asset at nearly the same pose are asked as
/// unlike levels of detail, since equal spheres on top of each other would count too much.
///
/// No allocation, lock or exception. Trees may be shared by threads; the workspace may not.
Penetration penetration(const PlacedTree& a, const PlacedTree& b,
                        const PenetrationSettings& settings, Workspace& workspace) noexcept;

/// An answer without what protruding spheres add where flat faces meet.
///
/// Nothing is left across a gap of a fifth of a mean sphere radius and more.
/// Nearer, and in the first fifth of depth, the volume is less.
/// Round and deeper contacts come back as they are. All is told from volume and force alone, so a
/// large ball that touches lightly may pass for flat.
/// Volume and force stay continuous in the pose. The force is the volume's gradient but for 15 %:
/// use it for contacts, not where energy must be kept.
/// volume_min is lowered to hold the new volume.
///
/// `whole`: what penetration() answered for these two by lenses (FieldUse::never), in the matched
/// measure, without a pair budget.
/// Takes a few nanoseconds.
Penetration without_protrusion(const Penetration& whole, const PlacedTree& a,
                               const PlacedTree& b) noexcept;

/// Distance of the inner spheres, witness points, and a certified interval for the solids.
///
/// Exact to about 1e-6 of the objects' size.
/// Once one object's spheres overlap the other's all is zero.
///
/// No allocation, lock or exception. Trees may be shared by threads; the workspace may not.
Separation separation(const PlacedTree& a, const PlacedTree& b, const SeparationSettings& settings,
                      Workspace& workspace) noexcept;

struct PenetrationAndSeparation {
  Penetration penetration;
  Separation separation;
};

/// Both in one call: the unified query of the Inner Sphere Trees papers.
PenetrationAndSeparation query(const PlacedTree& a, const PlacedTree& b,
                               const QuerySettings& settings, Workspace& workspace) noexcept;

/// A part of a contact that a solver may take for one contact point: the lenses near one region of
/// the smaller solid.
struct ContactPatch {
  /// Names the region: the same in every query of the same two trees in the same measure, so that a
  /// solver finds what it kept of the patch.
  /// Other pairs of trees use the same names.
  /// By Measure::exact it names the lowest pair of triangles that cross on the patch's outline, and
  /// stays while these do; 0 for a patch that lies inside the other solid as a whole.
  std::uint64_t id = 0;
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();  ///< [u] of the patch's overlap, world
  /// Unit, world: the direction in which the patch pushes B, from A to B; zero if the area is.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  /// [u²] |force|: what the contact surface measures, seen along the normal; 0 where that is
  /// rounding, as of a patch that lies wholly inside the other solid.
  double area = 0;
  /// [u] volume/area, ≤ the smaller solid's bounding diameter; 0 if no area. A mean: patches of one
  /// level face differ by a factor of two and more, as spheres fall to them.
  double depth = 0;
  double volume = 0;  ///< [u³] share of Penetration::volume
  /// [u²] share of −translation_gradient: the push on B of a pressure of 1 [force/u²]. A's is
  /// opposite.
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  /// [u³/rad] share of −rotation_gradient, about B's origin: not the moment of `force` at
  /// `centroid` alone, since a patch resists turning about its normal too.
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();
};

struct ContactPatches {
  /// The whole, the bits that penetration() answers without a pair budget, copies of one asset at
  /// nearly the same pose excepted: those are not asked as unlike levels here.
  Penetration penetration;
  std::size_t count = 0;  ///< patches written
};

/// The contact condensed into at most patches.size() patches.
///
/// Volumes, forces and torques sum to the whole's to about 1e-15.
/// By Measure::exact they are the connected parts of the overlap, each with its own true volume; if
/// they are more than there is room for, the least join the nearest ones.
/// By spheres the contact is divided along the tree of the smaller solid (B's if equal or if A is
/// too coarse), always at the same places. What a stopped query estimates of unopened nodes is
/// divided too. Costs 1.7 (one patch) to 2.4 (32) times a penetration.
///
/// No allocation, lock or exception. Trees may be shared by threads; the workspace may not.
ContactPatches contact_patches(const PlacedTree& a, const PlacedTree& b,
                               const ContactSettings& settings, Workspace& workspace,
                               std::span<ContactPatch> patches) noexcept;

/// A piece of the curve on which two surfaces cross.
struct OutlineSegment {
  Eigen::Vector3d from = Eigen::Vector3d::Zero();  ///< [u] world
  Eigen::Vector3d to = Eigen::Vector3d::Zero();    ///< [u] world
  std::uint32_t patch = 0;  ///< number of the patch that it bounds; 0 without room for patches
};

struct OverlapOutline {
  ContactPatches contact;
  /// Of the whole outline; as many as there is room for are written. 0 where a limit stopped it.
  std::size_t segments = 0;
};

/// contact_patches() by Measure::exact, whatever the settings say, with the outline of each patch:
/// segments of the closed curves on which the surfaces cross, A's surface inside B to the left of
/// each seen from outside A. A patch that lies inside the other solid as a whole has none.
///
/// No allocation, lock or exception. Trees may be shared by threads; the workspace may not.
OverlapOutline overlap_outline(const PlacedTree& a, const PlacedTree& b,
                               const ContactSettings& settings, Workspace& workspace,
                               std::span<ContactPatch> patches,
                               std::span<OutlineSegment> segments) noexcept;

/// Patches without what protruding spheres add where flat faces meet, as without_protrusion() of a
/// penetration: each by its own depth, so that faces that lean against each other lose it where
/// they hardly touch and keep the rest.
///
/// Volumes, areas, forces and torques become less; a patch of which nothing is left stays, with
/// zeros and no normal. Patches whose spheres met a surface, and those of the inner and the exact
/// measure, are as they should be and stay. So may stay what the Penetration of the same answer
/// says: it is another sum now.
///
/// `patches`: what contact_patches() wrote for these two under these settings.
void without_protrusion(std::span<ContactPatch> patches, const PlacedTree& a, const PlacedTree& b,
                        const ContactSettings& settings) noexcept;

/// Two placed solids of a batch.
struct PlacedPair {
  PlacedTree a, b;
};

/// How penetration_batch reaches the caller's threads: two pointers, nothing that allocates.
struct ParallelFor {
  /// Calls work(batch, i) once for each i in [0, workers), on any threads, at the same time or one
  /// after another, and returns when all calls have. Null: the calling thread does it all.
  void (*run)(void* pool, std::size_t workers, void (*work)(void* batch, std::size_t worker),
              void* batch) = nullptr;
  void* pool = nullptr;  ///< handed to `run`
};

/// answers[i] = penetration(pairs[i]), the same bits, for as many as there are answers.
///
/// There are as many workers as workspaces; without any, every answer is budget_exhausted with no
/// upper bound.
/// Pairs are handed out by an atomic counter, so that a pool need not balance them.
///
/// No allocation or lock but the pool's own. An exception of `run` ends the program.
void penetration_batch(std::span<const PlacedPair> pairs, const PenetrationSettings& settings,
                       std::span<Workspace> workspaces, std::span<Penetration> answers,
                       const ParallelFor& parallel = {}) noexcept;

/// answers[i] = contact_patches(pairs[i]), the same bits, for as many as there are answers.
///
/// `patches` are shared out evenly: with m = patches.size() / count, where count is the lesser of
/// pairs and answers, those of pair i begin at patches[i · m], and answers[i].count of them are
/// written.
///
/// Workspaces, pool and limits as penetration_batch() has them.
void contact_patches_batch(std::span<const PlacedPair> pairs, const ContactSettings& settings,
                           std::span<Workspace> workspaces, std::span<ContactPatches> answers,
                           std::span<ContactPatch> patches,
                           const ParallelFor& parallel = {}) noexcept;

}  // namespace ist
