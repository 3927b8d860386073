#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include <ist/mesh.h>

#include "library/input_mesh.h"

namespace ist::app {

/// close_as_asked(). Throws Error, with the option that may help.
ClosedMesh close_or_advise(TriangleMesh mesh, const std::string& name,
                           const MeshSettings& settings);

/// read_input_mesh(); what was found about the mesh goes to stderr as warnings. Throws Error.
InputMesh read_mesh_aloud(const std::string& path, const MeshSettings& settings);

/// How a mesh that was not closed was closed, and with what confidence; "" for one that was.
std::string describe_closing(const MeshReport& report);

/// The same with all that stands behind it; nulls for a mesh that was closed.
nlohmann::ordered_json closing_json(const MeshReport& report);

/// What a file declares about its axes and unit and what came of it; "" if it declares nothing.
std::string describe_declared(const DeclaredFrame& declared);

/// The same; null is what it does not declare.
nlohmann::ordered_json declared_json(const DeclaredFrame& declared);

}  // namespace ist::app
