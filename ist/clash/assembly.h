#pragma once

#include <ist/asset.h>
#include <ist/mesh.h>
#include <functional>
#include <map>

#include "clash/clash.h"
#include "library/robot_assets.h"
#include "library/settings/bake_settings.h"

namespace ist {

/// Values of a sweep's joint, from the first to the last.
struct JointRange {
  std::string joint;
  double first = 0, last = 0;
  std::size_t count = 1;
};

struct AssemblyOptions {
  RobotOptions robot;
  std::vector<JointRange> joints;  ///< for robots: one or several values of each
  std::string poses;               ///< CSV: a sweep; "": none
  std::string rules;               ///< TOML with [[ignore]] and [[group]] alone; "": none
  MeshSettings closing;            ///< repair and wrap, for meshes that are open
  unsigned threads = 0;            ///< 0: all cores
};

/// Parts in their places, and pairs that are not tested.
struct Assembly {
  /// A pose of a sweep, by part; or the only pose, without a name.
  struct Row {
    std::string name;
    std::vector<Pose> poses;
  };
  /// Pairs of one part from each set, by index of parts, are not tested.
  struct Rule {
    std::vector<bool> a, b;
  };
  /// A part without an answer: it is open, unreadable, or cannot be resolved.
  struct Fault {
    std::string part, what;
  };

  std::vector<ClashPart> parts;  ///< as placed in the first row; names are unique
  std::vector<Row> rows;         ///< at least one
  std::vector<Fault> faults;     ///< they are not in `parts`
  std::vector<std::string> notes;
  std::vector<std::shared_ptr<const Asset>> assets;  ///< to which the parts refer
  std::vector<Rule> rules;
  std::size_t count = 0;  ///< parts of the file, including those with faults and ignored ones
};

/// Reads a TOML of parts, a glTF scene (its nodes), a URDF, MJCF or SDF (its links). Throws Error
/// if the description is invalid; a mesh that is not a solid is a fault of its parts. A part whose
/// pairs are all ignored is not read.
Assembly read_assembly(const std::string& path, const AssemblyOptions& options);

/// find_clashes() for every row; returns the worst clash of each pair and its row.
std::vector<Clash> find_clashes(const Assembly& assembly, const ClashSettings& settings);

// The readers of assemblies return these to read_assembly().

/// A shape of one or more parts, in their frame.
struct ClashShape {
  std::string name;                    ///< for messages
  std::function<TriangleMesh()> mesh;  ///< throws Error; null: `name` is an asset's file
  double rounding = kFloat64, placing = kFloat64;
  double slack = 0;
};

struct ClashSource {
  struct Part {
    std::string name;
    std::size_t shape = 0;
    Pose pose;
    double scale = 1;
  };
  /// Patterns of part names, with wildcards * and ?.
  using Patterns = std::vector<std::string>;

  std::vector<ClashShape> shapes;
  std::vector<Part> parts;
  std::vector<std::string> notes;
  std::vector<std::pair<Patterns, Patterns>> ignored;  ///< in either order
  std::map<std::string, Patterns> groups;              ///< pairs within one are not tested
  /// The poses of a row of a sweep by its columns' numbers; null: a row contains one part's pose.
  std::function<std::vector<Pose>(const std::map<std::string, double>&)> posed;
};

/// `rules_alone`: refuses [[part]].
void read_clash_toml(const std::string& path, bool rules_alone, ClashSource& out);
void read_clash_scene(const std::string& path, ClashSource& out);
void read_clash_robot(const std::string& path, const RobotOptions& options, ClashSource& out);

}  // namespace ist
