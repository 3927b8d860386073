#pragma once

#include <nlohmann/json.hpp>
#include <string>

#include <ist/mesh.h>

namespace ist::app {

struct InputMesh {
  DeclaredFrame declared;
  ClosedMesh closed;
};

/// Loads and closes a mesh; what was found goes to stderr as warnings. Throws Error.
InputMesh read_input_mesh(const std::string& path, bool repair);

/// What a file declares about its axes and unit and what came of it; "" if it declares nothing.
std::string describe_declared(const DeclaredFrame& declared);

/// The same; null is what it does not declare.
nlohmann::ordered_json declared_json(const DeclaredFrame& declared);

}  // namespace ist::app
