#pragma once

#include <ist/mesh.h>
#include <functional>
#include <map>

#include "clash/assembly.h"

// The readers of assemblies return these to read_assembly().

namespace ist {

/// A shape of one or more parts, in their frame.
struct ClashShape {
  std::string name;                    ///< for messages
  std::function<TriangleMesh()> mesh;  ///< throws Error; null: an asset's file is `name`
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
  /// Parts that patterns name; * and ? stand for others.
  using Patterns = std::vector<std::string>;

  std::vector<ClashShape> shapes;
  std::vector<Part> parts;
  std::vector<std::string> notes;
  std::vector<std::pair<Patterns, Patterns>> ignored;  ///< in either order
  std::map<std::string, Patterns> groups;              ///< pairs within one are not asked
  /// Poses of a row of a sweep by its columns' numbers; null: rows hold a part's pose.
  std::function<std::vector<Pose>(const std::map<std::string, double>&)> posed;
};

/// `rules_alone`: [[part]] is refused.
void read_clash_toml(const std::string& path, bool rules_alone, ClashSource& out);
void read_clash_scene(const std::string& path, ClashSource& out);
void read_clash_robot(const std::string& path, const RobotOptions& options, ClashSource& out);

}  // namespace ist
