#pragma once

#include <functional>

#include "library/job.h"
#include "library/result.h"
#include "library/run_jobs.h"

namespace ist {

/// The asset of an input mesh. Throws Error; `progress` may cancel.
using BakeMesh = std::function<Asset(const ClosedMesh&, const BakeSettings&)>;

/// From the mesh's file to the asset's, or from the cache. `bake` is called where it is not in
/// there. Throws whatever goes wrong; what cannot be kept in the cache is a warning.
JobResult do_job(const Job& job, const RunSettings& settings, const BakeMesh& bake);

}  // namespace ist
