#pragma once

#include <cstddef>
#include <cstdint>
#include <functional>
#include <stdexcept>
#include <string>

/// Marks the namespace of every public header: a shared library exports what is declared there, and
/// nothing else.
#if defined(__GNUC__)
#define IST_API [[gnu::visibility("default")]]
#else
#define IST_API
#endif

namespace IST_API ist {

/// The one exception type of the offline stages (import … bake) and of Asset::load().
///
/// Its message names the file, the place and the remedy. A stage also lets std::bad_alloc and
/// exceptions of the caller's callback pass. Queries never throw; they return a
/// QueryStatus.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Thrown by close_mesh() for an open mesh that it may not repair, or whose repair has too little
/// confidence, so that a caller can offer repair or a wrap.
class OpenMeshError : public Error {
 public:
  using Error::Error;
};

/// State of a long offline stage.
struct Progress {
  /// "polygonise", "resolve", "pack", "calibrate", "cover", "tree", "predict"
  const char* stage = "";
  std::size_t spheres = 0;  ///< count so far
  double coverage = 0;      ///< [0, 1] of the solid's volume in inner spheres; "pack" only
  double radius = 0;        ///< [u] of the spheres being inserted now; "pack" only
  double fraction = 0;      ///< [0, 1] of this stage's work, an estimate
  double elapsed = 0;       ///< [s] since the stage began
};

/// The progress callback. It is called from the thread that started the stage: when packing and
/// predicting begin and then at most ten times a second, and after every step of the shorter
/// stages.
///
/// Return false to cancel: packing ends with what is packed so far, which is valid; other stages
/// throw Error. An exception in the callback ends the stage and reaches the caller.
using ProgressCallback = std::function<bool(const Progress&)>;

/// Rigid motion from an object's own frame to the world: x_world = R(q) x + t.
///
/// Lengths from 1e-150 to 1e150 are normalised: q means q/|q|. Others are invalid.
///
/// One range holds for every query, on the CPU and on GPUs. In the unit frame of a solid, the
/// coordinates of another solid's frame or of a point are at most 1e60. Sizes differ by at most
/// 1e60 : 1. A motion stays within this range. Beyond it queries return invalid_input.
///
/// Plain data of 56 bytes under every compiler flag. `pose_eigen.h` converts from and to Eigen.
struct Pose {
  double q[4] = {1, 0, 0, 0};  ///< quaternion w, x, y, z, normalised: of length 1e-150 to 1e150
  double t[3] = {0, 0, 0};     ///< [u] translation
};

}  // namespace ist

// Options and statuses of queries. Device code may include it.

namespace IST_API ist {

enum class QueryStatus : std::uint32_t {
  ok = 0,  ///< finished: the gradients are exactly those of the returned volume
  /// A limit of the settings or the workspace's capacity stopped the descent. volume_min and
  /// volume_max still contain the finished sum (exact: the true volume).
  budget_exhausted = 1,
  /// All numbers of the answer are NaN, its counts 0. The cause is a pose with NaN or Inf; a
  /// quaternion of length 0; a scale ≤ 0; an empty tree; a shape's number out of range; sizes or
  /// distances more than 1e60 : 1 apart; a measure that has no name; a setting < 0 or NaN; a
  /// capacity of 0 contact patches; or a workspace that was moved from.
  invalid_input = 2,
  /// A solid lacks what the measure needs. Measure::exact needs both solids' meshes
  /// (AssetView::has_mesh; a shape has none), the others need spheres. All numbers of the
  /// answer are NaN.
  missing_data = 3,
  /// Finished, but the predicted error is larger than PenetrationSettings::relative_error: an asset
  /// has no mesh or one that errs more, or a pair budget or coincident copies left
  /// coarser spheres. The gradients are exactly those of the returned volume.
  error_exceeded = 4,
};

/// The representation of solids.
enum class Measure : std::uint32_t {
  /// Matched spheres, whose volumes sum to the solid's. Where they are too coarse for the contact
  /// of two solids of unlike sizes, the meshes answer as for `exact`, if both assets keep theirs
  /// (PenetrationSettings::spheres_only).
  matched = 0,
  inner = 1,  ///< inner spheres: a certified lower bound of the true volume
  /// The two meshes themselves: the true volume and its gradients, and bounds of the true volume.
  /// Needs the mesh in both assets (AssetView::has_mesh).
  exact = 2,
};

/// Yes and no are certain.
enum class YesNo : std::uint32_t {
  no = 0,
  yes = 1,
  unknown = 2,  ///< neither was shown, or the question cannot be answered
};

/// The answer of overlap() and contains().
struct YesNoAnswer {
  YesNo answer = YesNo::unknown;
  QueryStatus status = QueryStatus::ok;  ///< if it is not ok, the answer is unknown

  friend bool operator==(const YesNoAnswer& x, YesNo y) noexcept { return x.answer == y; }
};

/// A sphere in the unit frame of its solid (half-extent of the solid in (½, 1]).
struct Sphere {
  float x = 0, y = 0, z = 0;  ///< centre, unit frame
  float r = 0;                ///< radius, unit frame; rounded down for an inner sphere
};

/// The reason for the end of a packing.
enum class StopReason : std::uint32_t {
  sphere_count,
  coverage,
  min_radius,
  time_limit,
  cancelled,
  exhausted,  ///< nothing above float resolution fits
};

}  // namespace ist
