#pragma once

#include <functional>
#include <memory>
#include <optional>

#include <ist/types.h>

#include "arrays.h"

namespace ist::python {

/// Work for a separate thread: it must own all its data, and must not use Python objects.
using OfflineWork = std::function<void(const ProgressCallback&)>;

/// Runs a long stage while the calling thread checks for Ctrl-C and reports progress.
///
/// `progress` is called on the calling thread with a Progress; returning False cancels as
/// documented for the stage, exceptions propagate. Its last call reports completion. `rounds`: see
/// WholeProgress. Ctrl-C raises KeyboardInterrupt within 0.2 s: the stage is told to stop; if it is
/// in a step that cannot be interrupted, it ends in the background after this call has returned.
void run_offline(OfflineWork work, const py::object& progress, bool rounds = false);

/// The same for work with a result.
template <class Work>
auto offline(Work work, const py::object& progress = py::none(), bool rounds = false) {
  using Answer = decltype(work(ProgressCallback()));
  const auto answer = std::make_shared<std::optional<Answer>>();
  run_offline([work = std::move(work), answer](
                  const ProgressCallback& callback) mutable { answer->emplace(work(callback)); },
              progress, rounds);
  return std::move(**answer);
}

/// From a str or an os.PathLike.
std::string path_of(const py::object& path);

void add_offline(py::module_& module);

}  // namespace ist::python
