#pragma once

#include <cstdint>
#include <string>

#include <ist/query.h>
#include <ist/tree_view.h>

namespace ist::app {

/// A tree as a binary glTF 2.0 scene: one ball's mesh a level, in a material of its own, and a node
/// a sphere or node of the tree that is an instance of it. In the mesh's own unit and frame,
/// coordinates as floats about the asset's middle, where the node above them all stands.
///
/// `detail` in [0, header().detail_count], 0 for Measure::inner. The file's bytes.
std::string tree_glb(const TreeView& tree, Measure measure, std::uint32_t detail,
                     const std::string& name);

}  // namespace ist::app
