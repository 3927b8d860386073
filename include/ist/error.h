#pragma once

#include <stdexcept>
#include <string>

#include <ist/api.h>

namespace IST_API ist {

/// The one exception type of the offline stages (import … bake).
///
/// Its message names the file, the place and the way out.
/// Besides it only std::bad_alloc, and what the caller's own callback throws, leave a stage.
/// Queries never throw; they answer with a QueryStatus.
class Error : public std::runtime_error {
 public:
  using std::runtime_error::runtime_error;
};

/// What close_mesh() throws for an open mesh that it was not asked to repair, or whose repair is
/// not to be trusted, so that a caller can say how to ask for more.
class OpenMeshError : public Error {
 public:
  using Error::Error;
};

}  // namespace ist
