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

/// A part of an assembly. Its asset keeps a mesh.
struct ClashPart {
  std::string name;
  PlacedAsset solid;
  /// The rounding of its coordinates, as a fraction of them: that of float32 or of float64.
  double rounding = 0;
  double slack = 0;           ///< [u] how far its mesh may lie from the shape that is meant
  double placing = kFloat64;  ///< the rounding of its pose
};

/// [u] How far rounding and slack let its surface lie from where it is meant to be, at most.
double uncertainty_of(const ClashPart& part);

/// How coordinates of a mesh's file are rounded: as its format stores them.
double rounding_of_file(const std::string& path);

struct ClashSettings {
  double clearance = 0;  ///< [u] ≥ 0: pairs that are nearer are listed too
  /// [u] Parts that reach no further into each other than this touch, and so do parts that are no
  /// further apart. Below 0: what rounding and slack of both parts come to.
  double touch_within = -1;
  unsigned threads = 0;  ///< 0: all cores
};

enum class ClashKind { overlapping, touching, apart };

/// Two parts that overlap, touch, or are nearer than the clearance: a before b. In [u], world
/// frame.
struct Clash {
  std::size_t a = 0, b = 0;
  ClashKind kind = ClashKind::apart;
  double volume = 0, volume_min = 0, volume_max = 0;  ///< [u³] of the overlap, and bounds of it
  /// [u²] Touching: of the faces that lie on each other; where they do so within the tolerance
  /// alone, of the overlap once B has moved by this towards A.
  double contact_area = 0;
  Eigen::Vector3d centroid = Eigen::Vector3d::Zero();  ///< of the overlap or the contact
  /// Unit, in which B leaves A; zero if there is no single one.
  Eigen::Vector3d direction = Eigen::Vector3d::Zero();
  /// Mean depth of the overlap's deepest connected part: its volume over its area seen along
  /// `direction`. If one solid is wholly inside the other, the diameter of its bounds.
  double depth = 0;
  double distance_min = 0, distance_max = 0;
  QueryStatus status = QueryStatus::ok;  ///< not ok: told as overlapping, since it may be
  bool duplicate = false;                ///< both are one shape in one place
  std::string pose;                      ///< of a sweep: where it was found
};

/// Adds a note where rounding alone moves parts by a thousandth of their size, and decides.
void note_rounding(std::span<const ClashPart> parts, const ClashSettings& settings,
                   std::vector<std::string>& notes);

/// Pairs that nobody asks for, by indices of parts.
using PairFilter = std::function<bool(std::size_t a, std::size_t b)>;

/// All pairs that overlap, touch or are nearer than the clearance, by the exact measure; in the
/// order of a, then b. The same bits for any number of threads. Throws Error, naming the part, for
/// a pose or a scale that is invalid, or an asset without a mesh.
std::vector<Clash> find_clashes(std::span<const ClashPart> parts, const ClashSettings& settings,
                                const PairFilter& ignored = {});

/// Whether x is the worse of two clashes of the same parts: by kind, volume, area, nearness.
bool is_worse(const Clash& x, const Clash& y);

struct ClashReport {
  using Names = std::pair<std::string, std::string>;  ///< of two parts, sorted

  std::size_t parts = 0;  ///< also those with faults
  std::vector<std::string> names;
  std::span<const Clash> pairs;
  double tolerance = -1;                                    ///< [u³] below 0: not asked for
  bool swept = false;                                       ///< over several poses
  std::vector<std::pair<std::string, std::string>> faults;  ///< part, what
  std::vector<std::string> notes;
  bool compared = false;    ///< with an earlier run
  std::set<Names> earlier;  ///< its clashes

  Names names_of(const Clash& clash) const;
  /// "certainly above" the tolerance, "certainly below" it, or "undecided".
  const char* verdict(const Clash& clash) const;
  /// It overlaps, and not certainly below the tolerance.
  bool is_clash(const Clash& clash) const;
  std::size_t new_clashes() const;
  std::vector<Names> resolved() const;
};

nlohmann::ordered_json clashes_json(const ClashReport& report);  ///< docs/json.md
std::string clashes_csv(const ClashReport& report);
std::string clashes_text(const ClashReport& report);
/// With five digits, and a tenth of a unit however far from the origin.
std::string place_text(const Eigen::Vector3d& x);

/// The clashes of a report of `ist clash --json`. Throws Error where the file is none.
std::set<ClashReport::Names> read_clashes(const std::string& path);

/// A zip of the BIM Collaboration Format 2.1: a topic a clash, with a viewpoint. A pair of names
/// has the same topic in every run. `date`: ISO 8601.
std::string clashes_bcf(const ClashReport& report, const std::string& date);

const char* name_of(ClashKind kind) noexcept;

}  // namespace ist
