#pragma once

#include <cstddef>
#include <cstdint>
#include <limits>
#include <memory>
#include <optional>
#include <span>
#include <vector>

#include <ist/query.h>
#include <ist/raycast.h>
#include <ist/time_of_impact.h>
#include <ist/types.h>

namespace IST_API ist {

/// The query that a scene makes for two bodies.
enum class SceneAnswer : std::uint32_t {
  nothing = 0,      ///< they do not meet
  boxes = 1,        ///< they meet where their boxes do, each half the margin wider
  overlap = 2,      ///< overlap(), within the margin: yes, no or unknown
  penetration = 3,  ///< penetration(), and separation() where a margin is set
  patches = 4,      ///< contact_patches(), likewise
  impact = 5,       ///< time_of_impact() over their motions; boxes contain their paths
};

/// The query for bodies of two groups.
struct SceneRule {
  SceneAnswer answer = SceneAnswer::penetration;
  /// Measure and limits. The scene sets no pair_id.
  PenetrationSettings penetration = {};
  /// [u] ≥ 0: bodies within this distance are reported too, with their separation.
  double margin = 0;
  ImpactSettings impact = {};  ///< SceneAnswer::impact
};

/// A solid in a scene.
struct SceneBody {
  /// The caller's number, unique in its scene: bodies are named by it, and pairs are in its order.
  std::uint32_t number = 0;
  PlacedSolid solid = {};
  bool moves = true;  ///< pairs of bodies that do not move are not queried, nor are two shapes
  std::uint32_t group = 0;    ///< < kSceneGroups: selects the rule of a pair
  std::uint32_t layers = 1;   ///< bits
  std::uint32_t meets = ~0u;  ///< bits: layers of bodies that it meets; both must agree
  Motion motion = {};         ///< from its pose on, for SceneAnswer::impact
};
inline constexpr std::uint32_t kSceneGroups = 8;

/// A pair is new, or it met in the step before.
enum class SceneEvent : std::uint32_t { begins = 0, stays = 1 };

/// Two bodies that meet: their volume is positive, or they touch, or they come within the margin,
/// or it is unknown; with SceneAnswer::impact, unless they stay clear. Answers that failed are here
/// too: their status says why.
struct ScenePair {
  std::uint32_t a = 0, b = 0;  ///< numbers, a < b; A of the query is `a`
  SceneEvent event = SceneEvent::begins;
  YesNo overlapping = YesNo::unknown;  ///< SceneAnswer::overlap alone
  std::uint32_t slot = ~0u;            ///< where its answers are
  std::uint32_t patch_count = 0;
};

struct ScenePairName {
  std::uint32_t a = 0, b = 0;
};

struct SceneSettings {
  std::size_t max_bodies = 1024;              ///< memory for as many is taken at once
  std::size_t max_pairs = 8192;               ///< pairs of bodies whose boxes meet, in one step
  std::uint32_t patches_per_pair = 8;         ///< at most, for SceneAnswer::patches
  std::size_t workers = 1;                    ///< workspaces: as many threads may work at a step
  std::size_t workspace_capacity = 1u << 20;  ///< see Workspace
};

/// The results of a step. The spans stay until the next call of a function that is not const.
struct SceneStep {
  std::span<const ScenePair> pairs;      ///< that meet, by (a, b)
  std::span<const ScenePairName> ended;  ///< met in the step before, by (a, b)
  std::span<const std::uint32_t>
      refused;  ///< left out: pose, scale, motion or shape not usable, or beyond 1e37 [u]
  std::size_t boxes_met = 0;  ///< pairs of bodies whose boxes meet
  /// There were too many pairs (SceneSettings::max_pairs): none was queried, `pairs` is empty, and
  /// no pair ended.
  bool pairs_exceeded = false;
};

struct SceneHit {
  std::uint32_t number = 0;  ///< of the body, if `hit` is one
  RayHit hit;
};

struct SceneNearest {
  std::uint32_t number = 0;  ///< of the body, if there is one
  /// An infinite distance: no body is near enough.
  SurfacePoint surface = {.distance = std::numeric_limits<double>::infinity()};
};

/// Many solids, and which of them meet: a broad phase over the queries of pairs, and no more.
/// Bodies, islands, sleeping and solving stay with the host.
///
/// Boxes of bodies are in two hierarchies, of those that move and those that do not. A step queries
/// the pairs whose boxes meet and one of whose bodies was added or moved; the others keep the
/// answers of the step before. Poses and rules alone decide the answers: they have the same bits
/// and order for any number of workers and any order of insertion.
///
/// A step allocates nothing, locks nothing but what the pool does, and throws nothing. A scene is
/// one thread's at a time; const functions may run on several. Assets must outlive their bodies.
class Scene {
 public:
  /// Throws std::bad_alloc, and Error for numbers of 0 or too large.
  explicit Scene(const SceneSettings& settings = {});
  ~Scene();
  Scene(Scene&&) noexcept;
  Scene& operator=(Scene&&) noexcept;

  /// Throws Error for a number that is taken, a group that is too large or a full scene; a pose
  /// that is not usable is refused in the step.
  void add(const SceneBody& body);
  /// False: there is none. Its pairs end in the next step, its exclusions at once.
  bool remove(std::uint32_t number) noexcept;
  /// False: there is none.
  bool set_pose(std::uint32_t number, const Pose& pose) noexcept;
  /// Returns how many there are.
  std::size_t set_poses(std::span<const std::uint32_t> numbers,
                        std::span<const Pose> poses) noexcept;
  /// Like set_poses(), for motions.
  std::size_t set_motions(std::span<const std::uint32_t> numbers,
                          std::span<const Motion> motions) noexcept;
  std::size_t size() const noexcept;
  const SceneSettings& settings() const noexcept;
  std::vector<std::uint32_t> numbers() const;  ///< of all bodies, the lowest first
  std::optional<SceneBody> body(std::uint32_t number) const;

  /// The rule for bodies of two groups, whichever is which. Queries all pairs again. Throws Error
  /// for groups that are too large, an answer or measure without a name, a margin that is negative
  /// or NaN, or a duration that is not above 0.
  void set_rule(std::uint32_t group_a, std::uint32_t group_b, const SceneRule& rule);
  /// Bodies that are joined: as long as both are there they do not meet. Throws std::bad_alloc.
  void exclude(std::uint32_t a, std::uint32_t b);
  void include(std::uint32_t a, std::uint32_t b) noexcept;
  /// Pairs for which it returns false do not meet. It must not change from call to call while
  /// neither body moves. Null: all meet.
  void set_filter(bool (*filter)(const void* context, std::uint32_t a, std::uint32_t b) noexcept,
                  const void* context) noexcept;

  /// Queries all pairs that may have changed.
  SceneStep step(const ParallelFor& parallel = {}) noexcept;
  /// Answers to a pair of the last step: all zero if its rule requests none. The separation of
  /// overlapping bodies is zero.
  Penetration penetration(const ScenePair& pair) const noexcept;
  Separation separation(const ScenePair& pair) const noexcept;
  TimeOfImpact impact(const ScenePair& pair) const noexcept;
  std::span<const ContactPatch> patches(const ScenePair& pair) const noexcept;

  /// The state of the next step: bodies, rules, exclusions and the pairs that met, with the content
  /// hashes of assets. Filters store what they refuse now. Throws Error for a FunctionShape.
  std::vector<std::byte> record() const;
  /// The scene that was recorded, of which the next step has the same bits. Throws Error where the
  /// record is none or an asset is missing, naming its hash, whatever the bytes.
  static Scene replay(std::span<const std::byte> record, std::span<const AssetView> assets,
                      std::size_t workers = 1);

  /// The first body that a ray meets, where bodies stand now; equally near ones: the lowest number.
  /// Bodies that rays do not support (<ist/raycast.h>) and those that are refused are passed. An
  /// invalid ray: invalid_input, and NaN.
  SceneHit raycast(const Ray& ray) const noexcept;
  /// The body nearest to a point, where bodies stand now: that of the least signed distance, so of
  /// those that hold the point the one in which it lies deepest; equally near ones: the lowest
  /// number. Bodies beyond `max_distance` [u], those that closest_point() does not support and
  /// those that are refused are passed. A point that is not finite, or a distance of NaN:
  /// invalid_input, and NaN.
  SceneNearest nearest(
      const Eigen::Vector3d& point,
      double max_distance = std::numeric_limits<double>::infinity()) const noexcept;
  /// Bodies whose boxes meet a box [u], in no order: how many there are; as many as fit are
  /// written. A box of NaN, or whose `lower` is above `upper`, meets none but bodies without a box.
  std::size_t in_box(const Eigen::Vector3d& lower, const Eigen::Vector3d& upper,
                     std::span<std::uint32_t> numbers) const noexcept;

 private:
  struct Impl;
  std::unique_ptr<Impl> impl_;
};

}  // namespace ist
