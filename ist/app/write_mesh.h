#pragma once

#include <string>

#include <ist/mesh.h>

namespace ist::app {

/// Writes a mesh as .obj, .ply (ASCII) or .off with every digit of its doubles, or as .stl (binary;
/// the format itself keeps single precision): its ending decides. Throws Error.
void write_mesh(const TriangleMesh& mesh, const std::string& path);

}  // namespace ist::app
