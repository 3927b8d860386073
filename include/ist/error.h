#pragma once

#include <stdexcept>
#include <string>

#include <ist/api.h>

namespace IST_API ist {

/// The one exception type of the offline stages (import … bake) and of Asset::load().
///
/// Its message names the file, the place and the remedy. A stage also lets std::bad_alloc and
/// exceptions of the caller's callback pass. Queries never throw; they return a
/// QueryStatus.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// Thrown by close_mesh() for an open mesh that it may not repair, or whose repair has too little
/// confidence, so that a caller can offer repair or a wrap.
class OpenMeshError : public Error {
 public:
  using Error::Error;
};

}  // namespace ist
