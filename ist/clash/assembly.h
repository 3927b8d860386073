#pragma once

#include <ist/asset.h>

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
  std::vector<JointRange> joints;  ///< robots: of each, one value or several
  std::string poses;               ///< CSV: a sweep; "": none
  std::string rules;               ///< TOML with [[ignore]] and [[group]] alone; "": none
  MeshSettings closing;            ///< repair and wrap, for meshes that are open
  unsigned threads = 0;            ///< 0: all cores
};

/// Parts in their places, and what is not to be asked of them.
struct Assembly {
  /// A pose of a sweep, by part; or the only one, without a name.
  struct Row {
    std::string name;
    std::vector<Pose> poses;
  };
  /// Pairs of one part of each set, by index of parts, are not asked.
  struct Rule {
    std::vector<bool> a, b;
  };
  /// A part without an answer: it is open, cannot be read, or cannot be resolved.
  struct Fault {
    std::string part, what;
  };

  std::vector<ClashPart> parts;  ///< as they stand in the first row; names differ
  std::vector<Row> rows;         ///< at least one
  std::vector<Fault> faults;     ///< these are no parts
  std::vector<std::string> notes;
  std::vector<std::shared_ptr<const Asset>> assets;  ///< which the parts view
  std::vector<Rule> rules;
  std::size_t count = 0;  ///< parts of the file, also those with faults and those ignored
};

/// Reads a TOML of parts, a glTF scene (its nodes), a URDF, MJCF or SDF (its links). Throws Error
/// for what is wrong with the description; a mesh that is no solid is a fault of its parts. A part
/// whose pairs are all ignored is not read.
Assembly read_assembly(const std::string& path, const AssemblyOptions& options);

/// find_clashes() of every row; of each pair the worst, and in which row it was.
std::vector<Clash> find_clashes(const Assembly& assembly, const ClashSettings& settings);

}  // namespace ist
