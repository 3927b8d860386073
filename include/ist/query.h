#pragma once

#include <Eigen/Core>
#include <cstddef>
#include <cstdint>
#include <memory>
#include <span>
#include <variant>

#include <ist/asset.h>
#include <ist/shapes.h>
#include <ist/types.h>

namespace IST_API ist {

/// Limits of a penetration and of contact patches. Zero, a negative value or NaN means no limit.
/// Without limits the answer is the finished sum.
///
/// No query reads a clock: poses and settings decide the answer. <ist/deadline.h> chooses a pair
/// budget from measured times.
///
/// A stopped query estimates the rest from the densities of the unopened nodes. It returns
/// budget_exhausted, and a volume no larger than that of the smaller solid's spheres.
///
/// Measure::exact obeys max_visits only. If that stops it, the answer is that of the matched
/// spheres (NaN where an asset has none) with budget_exhausted, and the true volume is bounded by 0
/// and the smaller solid's.
struct PenetrationSettings {
  Measure measure = Measure::matched;
  /// Matched measure only: spheres answer even where they are too coarse for the contact of two
  /// solids of unlike sizes, and may be wrong by any factor (<ist/mass_properties.h>). For loops
  /// that must end in a bounded time: the exact measure obeys no pair budget.
  bool spheres_only = false;

  /// Count of sphere pairs to spend; two trees in the matched measure only (the inner one has no
  /// levels of detail).
  ///
  /// The answer comes from the finest level of detail that is expected to need no more pairs. A
  /// level that needs more than 0.7 of the budget is blended with the next coarser one: volume and
  /// force stay continuous, and gradients are those of the blended sum. Shallow contacts keep all
  /// spheres. The count is a target, not a bound: the coarsest level is the minimum, whatever it
  /// costs.
  std::uint32_t pair_budget = 0;

  /// Count of node pairs opened: a hard limit, whatever the error of the answer. Pairs are
  /// opened largest bounds first.
  std::uint32_t max_visits = 0;

  /// Accepted relative error of the volume, such as 0.005 for 0.5 %; two trees in the matched
  /// measure only. Over random poses the median error is less than a third of this, and about 19 of
  /// 20 errors are below this. Flat faces that rest on each other have larger errors by spheres.
  ///
  /// The query uses the cheapest measure whose predicted error is smaller: the coarsest level of
  /// detail that is accurate enough at this overlap, or Measure::exact where no level is, or where
  /// few triangles cross. Neighbours are blended: volume and force stay continuous, and gradients
  /// are those of the blended sum. The prediction comes from the trials of the bake
  /// (AssetView::predicted_errors), or else from a fit.
  ///
  /// Needs the mesh in both assets (AssetView::has_mesh), and no pair budget. Otherwise the finest
  /// level, or the finest within the budget, answers; if its predicted error is larger than this,
  /// the status is error_exceeded. Assets without spheres are answered by Measure::exact.
  double relative_error = 0;

  /// The caller's id of this pair of solids; 0: none. Calls with the same id and workspace are
  /// steps of one motion: exact queries keep the nearby triangles and search again only after too
  /// much motion. It changes no bit of an answer except node_visits. At its default capacity a
  /// workspace keeps up to 1,024 pairs of solids and a quarter of a million pairs of triangles.
  /// Nothing is kept under max_visits.
  std::uint32_t pair_id = 0;
};

using ContactSettings = PenetrationSettings;

/// Limits of a separation. Zero, a negative value or NaN means no limit.
struct SeparationSettings {
  std::uint32_t max_visits = 0;  ///< count of node pairs opened, depth first
  bool inner_spheres = false;    ///< use the inner spheres even if both assets keep a mesh

  /// [u] For solids that are farther apart than this, distance and distance_min are max_distance,
  /// distance_max is infinite, points and normal are NaN, and the status is ok. That is certified,
  /// and takes a few microseconds unless the distance is near it.
  double max_distance = 0;

  /// Like PenetrationSettings::pair_id, for distances of surfaces: the nearest triangles are kept,
  /// and bound the next distance. It changes no bit of an answer except node_visits and
  /// sphere_pairs. One pair of solids may have the same id in both settings.
  std::uint32_t pair_id = 0;
};

/// Limits of both halves of query().
struct QuerySettings {
  PenetrationSettings penetration = {};
  SeparationSettings separation = {};
};

/// An asset at a pose, under an optional uniform scale: x_world = R (scale · x) + t.
struct PlacedAsset {
  AssetView asset = {};
  Pose pose = {};
  double scale = 1;  ///< > 0, about the object's own origin, before the pose
};

/// A shape at a pose, under an optional uniform scale: x_world = R (scale · x) + t.
struct PlacedShape {
  Shape shape = {};
  Pose pose = {};
  double scale = 1;  ///< > 0
};

/// A solid of a query: an asset or a shape at a pose.
///
/// A query takes two assets, or an asset and a shape in either order. Two shapes hold no spheres:
/// the answer is missing_data.
struct PlacedSolid {
  PlacedSolid() = default;
  PlacedSolid(const PlacedAsset& asset) : placed(asset) {}
  PlacedSolid(const PlacedShape& shape) : placed(shape) {}
  PlacedSolid(const AssetView& asset, const Pose& pose, double scale = 1)
      : placed(PlacedAsset{asset, pose, scale}) {}
  PlacedSolid(const Shape& shape, const Pose& pose, double scale = 1)
      : placed(PlacedShape{shape, pose, scale}) {}

  std::variant<PlacedAsset, PlacedShape> placed;
};

/// A rigid motion of constant velocity: one point of the object moves straight, and the object
/// turns about it. [T] is a unit of time of the caller's.
struct Motion {
  Eigen::Vector3d velocity = Eigen::Vector3d::Zero();          ///< [u/T] of `about`, world
  Eigen::Vector3d angular_velocity = Eigen::Vector3d::Zero();  ///< [rad/T] world
  /// [u] The point that moves straight, the centre of mass for a free body. In the object's own
  /// frame, before its scale.
  Eigen::Vector3d about = Eigen::Vector3d::Zero();
};

/// Overlap of two placed solids. Gradients are taken with respect to a motion of B, A held still.
///
/// With Measure::exact the volume has a kink where faces are flush or copies lie in place. There
/// the gradients are those towards one side, the same for (A, B) and (B, A): where B moves away
/// from A along the line of the middles of their bounding boxes, and somewhat across. Of copies of
/// one asset about one middle it is a side that is fixed in A's frame.
struct Penetration {
  double volume = 0;  ///< [u³] in the chosen measure
  /// [u³] With Measure::exact: bounds of the true volume. By spheres: the interval of the finished
  /// sum, as wide as its rounding and the part that a limit left out. It does not bound the true
  /// volume.
  double volume_min = 0;
  double volume_max = 0;
  /// [u] Of the overlap, world. Where solids touch in faces: of these. Zero if there is neither.
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();
  /// [u²] The force on B of a pressure of 1 [force/u²]: −dV/d(translation of B), world. The force
  /// on A is the opposite. Contact laws (<ist/contact_law.h>) have pressures that grow with depth.
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  /// [u³/rad] Its torque on B about B's origin: −dV/d(rotation vector of B), world.
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();
  /// [u²] Measure::exact, where the solids touch: of the faces that lie on each other, in one plane
  /// to 64 times what counts as touching. 0 where they touch in points and edges alone.
  double contact_area = 0;
  /// Unit, from A to B, world: the mean normal of these faces. Zero without faces, and where their
  /// normals cancel, as around a pin in its hole.
  Eigen::Vector3d contact_normal = Eigen::Vector3d::Zero();
  QueryStatus status = QueryStatus::ok;
  std::uint32_t node_visits = 0;  ///< node pairs opened
  /// Non-empty lenses summed, spheres tested against a shape, and spheres that lie wholly in the
  /// other solid. With Measure::exact: crossing triangles.
  std::uint32_t sphere_pairs = 0;
  /// Measure::exact: the solids meet in points, edges or faces, and the volume is 0. Solids nearer
  /// than the rounding of poses and vertices, some 1e-14 of both sizes and their distance, touch.
  /// So do solids that cross by a volume within its rounding. By spheres: false.
  bool touching = false;
};

/// Gap of two placed solids: between their surfaces if both assets keep a mesh, else between inner
/// spheres, or inner spheres and a shape. All zero once these overlap. For solids that are farther
/// apart than SeparationSettings::max_distance see there.
struct Separation {
  double distance = 0;      ///< [u] between surfaces or inner spheres
  double distance_min = 0;  ///< [u] lower bound of the true distance of the solids, certified
  /// [u] upper bound, certified. If meshes that were made from signed
  /// distances overlap, it is their error (MeshHeader::error).
  double distance_max = 0;
  Eigen::Vector3d point_a = Eigen::Vector3d::Zero();  ///< [u] on A's surface or spheres, world
  Eigen::Vector3d point_b = Eigen::Vector3d::Zero();  ///< [u] on B's surface or spheres, world
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();   ///< unit, from A to B, world
  QueryStatus status = QueryStatus::ok;
  std::uint32_t node_visits = 0;   ///< node pairs opened
  std::uint32_t sphere_pairs = 0;  ///< pairs of triangles or spheres measured
};

/// Memory functions of a workspace, called on construction and destruction.
struct MemoryHooks {
  /// Returns at least `bytes` bytes at a multiple of `alignment`, a power of two; null if out of
  /// memory. A null pointer here selects operator new.
  void* (*allocate)(void* context, std::size_t bytes, std::size_t alignment) = nullptr;
  void (*release)(void* context, void* memory, std::size_t bytes, std::size_t alignment) = nullptr;
  void* context = nullptr;  ///< passed to both
};

/// Scratch memory of a query: make one per thread, once.
///
/// It never changes an answer. A query that needs more than its capacity stops with
/// budget_exhausted.
class Workspace {
 public:
  /// `capacity`: count of node pairs that may wait at once; workspace_capacity() returns what two
  /// solids need. It reserves 9 MB and 173 bytes per pair of address space (190 MB by default);
  /// pages are touched as needed. The default serves two trees of 64,000 spheres at any pose.
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

/// A capacity that suffices for two solids at any pose: penetration() and contact_patches() by
/// spheres alone, separation() by them and overlap() never exhaust it. Poses are ignored, scales
/// are not. For several pairs take the largest.
///
/// The bound is proven from the balls of both trees and is three to five times the need of the
/// worst poses: at least 4,096, and 169,140 for two cubes of 64,000 spheres. The call allocates,
/// and takes some 0.3 s for 16,000 spheres.
///
/// It does not cover time_of_impact() and Measure::exact, nor the meshes that answer for unlike
/// sizes (PenetrationSettings::spheres_only). A capacity c lets penetration() by the exact measure
/// open c + 2,048 pairs of blocks of 16 triangles and c / 64 + 8 blocks of a mesh that cross the
/// other: copies in place need most. Patches and outlines hold all crossings at once, c / 16 + 128.
/// The mesh must have no more than c blocks. What these return here may be too little for them (a
/// bolt in its nut: 10,710, where 34,816 are needed): use the default capacity.
///
/// Throws Error for an empty asset, one without spheres, a scale out of range, or two shapes.
std::size_t workspace_capacity(const PlacedSolid& a, const PlacedSolid& b);

/// Volume, wrench and centroid of the overlap.
///
/// By spheres the volume is a sum of lenses. Between solids whose spheres are of unlike sizes it
/// goes over smoothly into that of their meshes. The gradients of a finished query are those of the
/// returned volume. Copies of one asset at nearly the same pose are evaluated as unlike levels of
/// detail, since the sum over coincident equal spheres is too large.
///
/// With a shape, the volume is the sum over the asset's spheres of the part inside the shape.
/// volume_min and volume_max include the shape's error. max_visits applies; pair_budget has no
/// effect. Measure::exact returns missing_data: a shape has no mesh. A shape whose numbers are out
/// of range gives invalid_input.
///
/// No allocation, lock or exception. Trees and shapes may be shared by threads; the workspace may
/// not. This holds for all queries.
Penetration penetration(const PlacedSolid& a, const PlacedSolid& b,
                        const PenetrationSettings& settings, Workspace& workspace) noexcept;

/// Removes from an answer the volume that protruding spheres add where flat faces meet.
///
/// The result is zero across a gap of a fifth of a mean sphere radius or more. Between this gap
/// and a depth of a fifth of that radius, the volume is reduced; the force may grow. Round and
/// deeper contacts are unchanged. Only volume and force are used, so a light touch of a large ball
/// may be treated as flat. Volume and force stay continuous in the pose. The force is the volume's
/// gradient to within 15 %: use it for contacts, not where energy must be conserved. volume_min is
/// lowered to contain the new volume.
///
/// `whole`: the answer of penetration() for this pair by lenses
/// (PenetrationSettings::spheres_only), in the matched measure, without a pair budget. Takes a few
/// nanoseconds.
Penetration without_protrusion(const Penetration& whole, const PlacedAsset& a,
                               const PlacedAsset& b) noexcept;

/// Distance, witness points, and a certified interval for the solids.
///
/// If both assets keep a mesh (AssetView::has_mesh), this is the distance of the surfaces. The
/// interval is as wide as rounding and the meshes' error (AssetView::mesh_error). It is zero if the
/// surfaces cross or one solid contains the other. Otherwise it is the distance of the inner
/// spheres, exact to about 1e-6 of the objects' size, and all zero once these overlap. A stopped
/// query returns the nearest points that it found; its interval is still certified.
///
/// Batches on the GPU (<ist/gpu_query.h>) always use the inner spheres. The distance from a shape
/// is that of the asset's inner spheres, certified as far as the shape's are: see each shape.
///
/// If the gap is nearly constant over a large area, as between the threads of a nut and a bolt, a
/// query takes many times longer: in a loop, set pair_id, and max_distance to what matters.
Separation separation(const PlacedSolid& a, const PlacedSolid& b,
                      const SeparationSettings& settings, Workspace& workspace) noexcept;

struct PenetrationAndSeparation {
  Penetration penetration;
  Separation separation;
};

/// penetration() and separation() in one call: the unified query of the Inner Sphere Trees papers.
PenetrationAndSeparation query(const PlacedSolid& a, const PlacedSolid& b,
                               const QuerySettings& settings, Workspace& workspace) noexcept;

/// One point of a contact manifold: the part of a contact near one region of the smaller solid.
struct ContactPatch {
  /// Identifies the region for warm starting: the same in every query of the same two trees in the
  /// same measure. Ids repeat across pairs of trees.
  ///
  /// With Measure::exact it names a connected part of the overlap by the lowest pair of crossing
  /// triangles on its outline, and is the same while these cross; 0 for a part wholly inside the
  /// other solid. contact_patches() divides parts: 8 times this name, and the octant.
  std::uint64_t id = 0;
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();  ///< [u] of the patch's overlap, world
  /// Unit, world: the direction in which the patch pushes B, from A to B; zero if the area is 0.
  Eigen::Vector3d normal = Eigen::Vector3d::Zero();
  /// [u²] |force|: the area of the contact surface seen along the normal; 0 if it is only
  /// rounding, as for a patch wholly inside the other solid.
  double area = 0;
  /// [u] volume/area, ≤ the smaller solid's bounding diameter; 0 if no area. A mean: patches of one
  /// level face differ by a factor of two and more, depending on the spheres they contain.
  double depth = 0;
  double volume = 0;  ///< [u³] part of Penetration::volume
  /// [u²] part of Penetration::force.
  Eigen::Vector3d force = Eigen::Vector3d::Zero();
  /// [u³/rad] part of Penetration::torque, about B's origin: the moment of `force` at `point`, and
  /// `torsion` times `normal`.
  Eigen::Vector3d torque = Eigen::Vector3d::Zero();
  /// [u] World: the point of the wrench's central axis that is nearest to the centroid. `force`
  /// applied there has the patch's torque except for `torsion`. It is far away where forces nearly
  /// cancel, and the centroid if the area is 0.
  Eigen::Vector3d point = Eigen::Vector3d::Zero();
  double torsion = 0;  ///< [u³/rad] residual moment about the normal of a force at `point`
};

struct ContactPatches {
  /// The whole contact, bit for bit the answer of penetration() under the same settings, except for
  /// copies of one asset at nearly the same pose without a pair budget or relative error: here they
  /// are not evaluated as unlike levels. Under a pair budget or a relative error its counts may be
  /// larger.
  Penetration penetration;
  std::size_t count = 0;  ///< patches written
};

/// Condenses the contact into a manifold of at most patches.size() patches; if that is 0, the
/// answer is invalid_input.
///
/// Volumes, forces and torques sum to the whole's to about 1e-15.
///
/// By spheres the contact is divided along the tree of the smaller solid (B's if equal or if A is
/// too coarse; the asset's if the other is a shape), always at the same places. The estimate of a
/// stopped query is divided too. It costs 1.7 (one patch) to 2.4 (32) times a penetration. Under a
/// pair budget or a relative error the patches are those of the level of detail, or of
/// Measure::exact, with the largest weight in the blend. The difference between the blend and that
/// part is spread over them by volume: their sum stays continuous, and ids change where another
/// part takes over.
///
/// With Measure::exact the connected parts of the overlap are divided into the octants around their
/// centroids, in the frame of the smaller solid, each with its true volume: a level face has four
/// patches, a ring around a shaft eight, a small or deep contact one. If there are more patches
/// than fit, the smallest are merged with their nearest ones; of the octants first those that are
/// small and near. Patches are continuous in the pose while the parts are the same and all fit.
ContactPatches contact_patches(const PlacedSolid& a, const PlacedSolid& b,
                               const ContactSettings& settings, Workspace& workspace,
                               std::span<ContactPatch> patches) noexcept;

/// A piece of the curve on which two surfaces cross.
struct OutlineSegment {
  Eigen::Vector3d from = Eigen::Vector3d::Zero();  ///< [u] world
  Eigen::Vector3d to = Eigen::Vector3d::Zero();    ///< [u] world
  std::uint32_t patch = 0;  ///< index of the patch that it bounds; 0 if `patches` is empty
};

struct OverlapOutline {
  ContactPatches contact;
  /// Total count; as many as fit are written. 0 if a limit stopped the query.
  std::size_t segments = 0;
};

/// The connected parts of the overlap, undivided, as patches, and the outline of each: segments of
/// the closed curves on which the surfaces cross. The measure is Measure::exact whatever the
/// settings say. Seen from outside A, A's surface inside B is to the left of each segment. A patch
/// that lies wholly inside the other solid has no outline.
OverlapOutline overlap_outline(const PlacedAsset& a, const PlacedAsset& b,
                               const ContactSettings& settings, Workspace& workspace,
                               std::span<ContactPatch> patches,
                               std::span<OutlineSegment> segments) noexcept;

/// Removes from patches what protruding spheres add where flat faces meet, as without_protrusion()
/// of a penetration does. Each patch is corrected by its own depth, so inclined faces are corrected
/// only where they hardly touch.
///
/// Volumes are reduced; areas, forces and torques are scaled with them. A patch reduced to nothing
/// is kept, with zeros and no normal. Patches of solids of unlike sizes, where meshes may answer,
/// and those of the inner and the exact measure are unchanged. The accompanying Penetration is not
/// updated; it no longer equals the sum of the patches.
///
/// `patches`: those that contact_patches() wrote for these two under these settings.
void without_protrusion(std::span<ContactPatch> patches, const PlacedAsset& a, const PlacedAsset& b,
                        const ContactSettings& settings) noexcept;

/// Two placed solids of a batch.
struct PlacedPair {
  PlacedSolid a, b;
};

/// Runs a batch on the caller's threads: two pointers, no allocation.
struct ParallelFor {
  /// Calls work(batch, i) once for each i in [0, workers), on any threads, concurrently or not, and
  /// returns when all calls have returned. Null: the calling thread does it all.
  void (*run)(void* pool, std::size_t workers, void (*work)(void* batch, std::size_t worker),
              void* batch) = nullptr;
  void* pool = nullptr;  ///< passed to `run`
};

/// answers[i] = penetration(pairs[i]), bit for bit, for i below both sizes; others stay.
///
/// There is a worker for each workspace; without any, every answer is budget_exhausted with no
/// upper bound. An atomic counter hands out pairs, so a pool need not balance them.
///
/// No allocation or lock except the pool's own. An exception in `run` ends the program.
void penetration_batch(std::span<const PlacedPair> pairs, const PenetrationSettings& settings,
                       std::span<Workspace> workspaces, std::span<Penetration> answers,
                       const ParallelFor& parallel = {}) noexcept;

/// answers[i] = separation(pairs[i]), bit for bit, for i below both sizes. Workspaces, pool and
/// limits as for penetration_batch(): without a workspace every interval is unbounded.
void separation_batch(std::span<const PlacedPair> pairs, const SeparationSettings& settings,
                      std::span<Workspace> workspaces, std::span<Separation> answers,
                      const ParallelFor& parallel = {}) noexcept;

/// answers[i] = contact_patches(pairs[i]), bit for bit, for i below both sizes.
///
/// `patches` is divided evenly: with m = patches.size() / count, where count is the lesser of pairs
/// and answers, those of pair i begin at patches[i · m], and answers[i].count of them are written.
///
/// Workspaces, pool and limits as for penetration_batch().
void contact_patches_batch(std::span<const PlacedPair> pairs, const ContactSettings& settings,
                           std::span<Workspace> workspaces, std::span<ContactPatches> answers,
                           std::span<ContactPatch> patches,
                           const ParallelFor& parallel = {}) noexcept;

/// Tests two placed solids for a common point.
///
/// Yes: two inner spheres meet, and these lie in the solids. No: no two cover balls meet, and these
/// contain the solids. Unknown: the solids are near each other or hardly touch, or 256 pairs of
/// nodes have been opened.
///
/// For assets without spheres the surfaces decide, as with a margin of 0.
///
/// Stops at the first meeting pair of inner spheres: a fraction of the time of a penetration. With
/// a shape, it is certain as far as the shape's distances are: see each shape. Two shapes:
/// missing_data.
YesNoAnswer overlap(const PlacedSolid& a, const PlacedSolid& b, Workspace& workspace) noexcept;

/// Tests if two placed solids come within `margin` [u] ≥ 0 of each other. Yes and no are certain.
///
/// If both assets keep a mesh, `unknown` is left only where the distance is the margin to rounding
/// and the meshes' errors. Otherwise inner spheres and their covers decide, as above. Takes about
/// as long as overlap(), or a few microseconds, unless the distance is near the margin. A margin
/// that is negative, or NaN: invalid_input.
YesNoAnswer overlap(const PlacedSolid& a, const PlacedSolid& b, double margin,
                    Workspace& workspace) noexcept;

}  // namespace ist
