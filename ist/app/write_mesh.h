#pragma once

#include <ist/mesh.h>
#include <string>

namespace ist::app {

bool has_mesh_ending(const std::string& path);  ///< one that write_mesh() takes

/// Writes a mesh as .obj, .ply (ASCII) or .off with every digit of its doubles, or as .stl (binary;
/// the format itself keeps single precision): its ending decides. Throws Error.
void write_mesh(const TriangleMesh& mesh, const std::string& path);

}  // namespace ist::app
