#pragma once

#include <ist/query.h>
#include <functional>
#include <nlohmann/json.hpp>
#include <set>
#include <string>
#include <utility>
#include <vector>

namespace ist {

inline constexpr double kFloat32 = 0x1p-23, kFloat64 = 0x1p-52;

/// A part of an assembly. Its asset has a mesh.
struct ClashPart {
  std::string name;
  PlacedAsset solid;
  /// The relative rounding of its coordinates: that of float32 or of float64.
  double rounding = 0;
  double slack = 0;           ///< [u] bound on the distance of its mesh from the intended shape
  double placing = kFloat64;  ///< the rounding of its pose
};

/// [u] Bound on the distance of its surface from the intended place, by rounding and slack.
double uncertainty_of(const ClashPart& part);

/// The rounding of coordinates in a mesh's file, as determined by its format.
double rounding_of_file(const std::string& path);

struct ClashSettings {
  double clearance = 0;  ///< [u] ≥ 0: nearer pairs are listed too
  /// [u] Parts that penetrate each other no further than this touch, and so do parts within this
  /// distance. Negative: the sum of rounding and slack of both parts.
  double touch_within = -1;
  unsigned threads = 0;  ///< 0: all cores
};

enum class ClashKind { overlapping, touching, apart };

/// Two parts that overlap, touch, or are nearer than the clearance: a before b. In [u], world
/// frame.
struct Clash {
  std::size_t a = 0, b = 0;
  ClashKind kind = ClashKind::apart;
  double volume = 0, volume_min = 0, volume_max = 0;  ///< [u³] of the overlap, with bounds
  /// [u²] For touching parts: area of the faces that lie on each other; if they do so only within
  /// the tolerance, that of the overlap once B has moved by the tolerance towards A.
  double contact_area = 0;
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();  ///< of the overlap or the contact
  /// Unit direction in which B leaves A; zero if there is no single one.
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  /// Mean depth of the overlap's deepest connected part: its volume over its area projected along
  /// `direction`. If one solid is wholly inside the other, the diameter of its bounds.
  double depth = 0;
  double distance_min = 0, distance_max = 0;
  QueryStatus status = QueryStatus::ok;  ///< not ok: reported as overlapping, since it may be
  bool duplicate = false;                ///< both are the same shape in the same place
  std::string pose;                      ///< of a sweep: the row
};

/// Adds a note if rounding alone moves parts by a thousandth of their size, which is then decisive.
void note_rounding(std::span<const ClashPart> parts, const ClashSettings& settings,
                   std::vector<std::string>& notes);

/// Pairs to skip, by indices of parts.
using PairFilter = std::function<bool(std::size_t a, std::size_t b)>;

/// All pairs that overlap, touch or are nearer than the clearance, by the exact measure; sorted by
/// a, then b. The same bits for any number of threads. Throws Error, naming the part, for an
/// invalid pose or scale, or an asset without a mesh.
std::vector<Clash> find_clashes(std::span<const ClashPart> parts, const ClashSettings& settings,
                                const PairFilter& ignored = {});

/// True if x is the worse of two clashes of the same parts: by kind, volume, area, distance.
bool is_worse(const Clash& x, const Clash& y);

struct ClashReport {
  using Names = std::pair<std::string, std::string>;  ///< of two parts, sorted

  std::size_t parts = 0;  ///< including those with faults
  std::vector<std::string> names;
  std::span<const Clash> pairs;
  double tolerance = -1;                                    ///< [u³] negative: none requested
  bool swept = false;                                       ///< over several poses
  std::vector<std::pair<std::string, std::string>> faults;  ///< part, fault
  std::vector<std::string> notes;
  bool compared = false;    ///< with an earlier run
  std::set<Names> earlier;  ///< its clashes

  Names names_of(const Clash& clash) const;
  /// "certainly above" the tolerance, "certainly below" it, or "undecided".
  const char* verdict(const Clash& clash) const;
  /// True if it overlaps, and not certainly below the tolerance.
  bool is_clash(const Clash& clash) const;
  std::size_t new_clashes() const;
  std::vector<Names> resolved() const;
};

nlohmann::ordered_json clashes_json(const ClashReport& report);  ///< docs/json.md
std::string clashes_csv(const ClashReport& report);
std::string clashes_text(const ClashReport& report);
/// With five digits, but to a tenth of a unit however far from the origin.
std::string place_text(const Eigen::Vector3d& x);

/// The clashes of a report of `ist clash --json`. Throws Error for other files.
std::set<ClashReport::Names> read_clashes(const std::string& path);

/// A zip of the BIM Collaboration Format 2.1: one topic per clash, with a viewpoint. A pair of
/// names has the same topic in every run. `date`: ISO 8601.
std::string clashes_bcf(const ClashReport& report, const std::string& date);

const char* name_of(ClashKind kind) noexcept;

}  // namespace ist
